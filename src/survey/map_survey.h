#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/base/progress.h"
#include "visual_localization/features/feature_matcher.h"
#include "visual_localization/localization/similarity.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

constexpr int kOctants = 8;

/// Eighth of the compass, counter-clockwise: 0 is centred on east, 2 on north.
int octantOf(double yaw_rad);

/// Which sessions have looked which way where: cells of a grid, eight directions in each. "Here" is a cell and those
/// around it, within about 4 m.
class SightGrid {
 public:
  static constexpr double kCell_m = 2.5;

  void add(const Eigen::Vector2d& position_m, double yaw_rad, int session);
  /// Another session looks about the same way here.
  bool otherSession(const Eigen::Vector2d& position_m, double yaw_rad, int session) const;
  bool earlierSession(const Eigen::Vector2d& position_m, double yaw_rad, int session) const;
  bool oppositeWay(const Eigen::Vector2d& position_m, double yaw_rad) const;
  std::size_t cells() const { return cells_.size(); }

 private:
  struct TwoSessions {
    std::int32_t first = -1;   ///< the lowest; none is -1
    std::int32_t second = -1;  ///< any other
  };
  using Cell = std::array<TwoSessions, kOctants>;

  template <class Predicate>
  bool anyHere(const Eigen::Vector2d& position_m, int octant, Predicate holds) const;

  /// Sorted and not hashed: whoever makes a map could make all keys collide.
  std::map<std::uint64_t, Cell> cells_;
};

/// What one session brought.
struct SessionSurvey {
  std::size_t images = 0;
  std::int64_t first_ns = 0;  ///< earliest stamp
  std::int64_t last_ns = 0;   ///< latest stamp
  double path_m = 0.0;        ///< along its images, gaps included
  double driven_m = 0.0;      ///< the same without gaps
  double shared_m = 0.0;      ///< of it: another session has driven the same way there
};

/// Images of one session in a row with something in common.
struct Stretch {
  int session = 0;
  std::size_t first = 0;  ///< images of the map
  std::size_t last = 0;
  std::size_t images = 0;
  double length_m = 0.0;           ///< along the images; 0 for a single one
  std::size_t least_features = 0;  ///< of one of its images
  std::size_t seen_elsewhere = 0;  ///< images near to which another session has one without the flaw, facing alike
};

/// A step from one image of a session to the next.
struct Step {
  int session = 0;
  std::size_t from = 0;
  std::size_t to = 0;
  double length_m = 0.0;
};

/// When something is worth a line.
struct SurveyConfig {
  std::size_t few_features = 50;  ///< an image with fewer is weak
  double gap_m = 10.0;          ///< a longer step is a gap: nothing was recorded in it, and it is no part of the route
  std::size_t most_listed = 5;  ///< of steps
};

/// What a map covers, how densely, in which directions and where it is weak. Of n images in time n log n.
struct MapSurvey {
  std::vector<SessionSurvey> sessions;
  double driven_m = 0.0;                     ///< by all sessions, without gaps
  double route_m = 0.0;                      ///< without what an earlier session had driven the same way
  double shared_m = 0.0;                     ///< of the route: driven the same way by more than one session
  std::size_t cells = 0;                     ///< of SightGrid::kCell_m that have an image
  double median_step_m = 0.0;                ///< from one image of a session to the next
  double long_step_m = 0.0;                  ///< 95 % are not longer
  std::vector<Step> longest_steps;           ///< the longest first
  std::size_t gaps = 0;                      ///< steps longer than SurveyConfig::gap_m
  std::array<double, kOctants> heading_m{};  ///< driven in each direction, see octantOf()
  double one_way_m = 0.0;                    ///< of what was driven: nobody has driven there the other way
  std::vector<Stretch> one_way;
  std::vector<Stretch> weak;  ///< few features
  std::size_t weak_images = 0;
};

MapSurvey survey(const TrainingMap& map, const SurveyConfig& config = {});

using OfImage = std::function<bool(std::size_t image)>;

/// Of each session, in order of the map, where `belongs` holds. A gap ends a stretch.
std::vector<Stretch> stretchesOf(const TrainingMap& map, double gap_m, const OfImage& belongs,
                                 const OfImage& seen_elsewhere = {});

/// A landmark, for people to look at.
struct LandmarkPoint {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< map frame
  int session = 0;                                       ///< of the first image that shows it
};

/// Each landmark once, where the first image that shows it has it. Of a map with more than `most_images` every k-th
/// image is read; of more than `most_points` landmarks likewise. Both at least 1.
std::vector<LandmarkPoint> landmarkPoints(const TrainingMap& map, std::size_t most_images, std::size_t most_points);

/// What the landmarks of a map amount to. Their images are known without reading, all else is of the images read.
struct LandmarkSurvey {
  std::size_t images = 0;                ///< with a geometry, of the whole map
  std::size_t images_read = 0;           ///< of those
  std::size_t median = 0;                ///< landmarks of an image read; of an even number the larger in the middle
  std::size_t bytes = 0;                 ///< that the images read take in the file
  std::optional<std::size_t> landmarks;  ///< different ones; unknown unless all images were read
};

/// `most_images`: at least 1; of a map that has more, so many are read, evenly spread.
LandmarkSurvey landmarkSurvey(const TrainingMap& map, std::size_t most_images);

/// Images of one session in a row whose positions are about as good, within a factor of two.
struct ErrorStretch {
  int session = 0;
  double from_m = 0.0;  ///< along the images of the session
  double to_m = 0.0;
  double least_m = 0.0;  ///< of their standard deviations, per horizontal axis
  double most_m = 0.0;
};

/// By the covariance of each image, or else what its session's fixes leave; of no session of an older map that says
/// neither. `most_images`: of a larger map every k-th image is read. The images of a session follow each other.
std::vector<ErrorStretch> expectedErrors(const TrainingMap& map, std::size_t most_images);

/// When two images look alike although they are far apart, and how much work may go into finding them.
struct AmbiguityConfig {
  double near_m = 5.0;                       ///< an image not farther away shows the same scene
  double far_m = 20.0;                       ///< one farther away shows another scene
  double nearly_as_good = 0.7;               ///< similarity of the far one, as a share of the best near one's
  double least_similarity = 0.08;            ///< of the far one by SIFT; a weaker one would confirm no position
  double global_nearly_as_good = 0.985;      ///< the share for global features
  std::size_t most_images = 2000;            ///< of a larger map every k-th image is asked about, and compared with
  std::size_t shortlist = 5;                 ///< far images, the most alike globally, that are compared by SIFT
  std::uint64_t most_work = 10'000'000'000;  ///< pairs of SIFT descriptors
  MatchConfig match;
  SimilarityConfig similarity;
};

/// An image that looks nearly as much like one far away as like its neighbours.
struct AmbiguousImage {
  std::size_t image = 0;
  std::size_t twin = 0;        ///< the image far away
  double similarity = 0.0;     ///< to the twin, by SIFT
  double near_similarity = 0;  ///< to the best near image, by SIFT
};

struct AmbiguousPlaces {
  std::vector<AmbiguousImage> images;  ///< in order of the map
  std::vector<Stretch> stretches;      ///< successive ones among those asked about
  std::size_t asked = 0;               ///< images that were compared
  std::size_t unasked = 0;             ///< images for which no work was left
  std::size_t unjudged = 0;     ///< images without a near one that faces alike: nothing to hold the far ones against
  std::size_t stride = 1;       ///< every so many-th image was asked about
  std::size_t global_only = 0;  ///< images that are ambiguous when only global features are compared
};

/// Images whose best match far away is nearly as good as the best of their neighbours that face alike, of whichever
/// session. Global features make a shortlist, SIFT decides.
AmbiguousPlaces findAmbiguousPlaces(const TrainingMap& map, const AmbiguityConfig& config = {},
                                    const Progress& progress = {});

}  // namespace visual_localization

#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "geometry/session_geometry.h"
#include "map/position_index.h"
#include "visual_localization/geo/trajectory.h"
#include "visual_localization/geo/trajectory_cleaner.h"
#include "visual_localization/geometry/image_geometry.h"
#include "visual_localization/map/map_builder.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// A name for one more session of a map: `name`, or with a number behind it if it is in use.
inline std::string unusedName(const std::string& name, const std::set<std::string>& used) {
  std::string unused = name;
  for (std::size_t n = 2; used.count(unused) != 0; ++n) unused = name + "_" + std::to_string(n);
  return unused;
}

// Where the sessions of a map lie. What is refused is a std::runtime_error in one line.

/// A frame around the first believable fix, at the middle of their altitudes.
LocalFrame frameFor(const std::vector<Fix>& fixes, const TrajectoryCleanerConfig& config);
/// On the earth, since a tangent plane shows its far side near the datum again.
double distanceBetween_m(const GeodeticPoint& a, const GeodeticPoint& b);
/// Refuses fixes whose middle is farther than kFarthestSession_m from the datum.
void requireNear(const std::vector<Fix>& fixes, const GeodeticPoint& datum);
/// Refuses a path that spans less than kSmallestSession_m: all images of the drive would be on one spot.
void requireMotion(const CleanedTrajectory& cleaned);
/// Those that have a position, in order of time. `verdicts`: of cleaning, on each fix. Altitudes that no robot can have
/// or that stand out are left out, and those behind a change of what they are measured from are moved to those before.
std::vector<MapFix> inFrame(const std::vector<Fix>& fixes, const std::vector<FixVerdict>& verdicts,
                            const LocalFrame& frame);

/// The training images of each session of a map by their positions.
class SessionIndex {
 public:
  explicit SessionIndex(const TrainingMap& map);

  /// False for a session of which the map has no image.
  bool has(std::size_t session) const { return sessions_[session].index != nullptr; }
  /// The image of a session that is nearest to `position_m`; the session has one.
  Neighbour nearest(std::size_t session, const Eigen::Vector2d& position_m) const;
  /// Into `found`: images of a session that `accept` takes, as PositionIndex::nearest finds them.
  void nearest(std::size_t session, const Eigen::Vector2d& position_m, const PositionIndex::Search& search,
               const std::function<bool(std::size_t image)>& accept, std::vector<Neighbour>& found) const;

 private:
  struct Session {
    std::vector<std::size_t> images;
    std::unique_ptr<const PositionIndex> index;  ///< of their positions
  };

  std::vector<Session> sessions_;
};

/// Leaves out positions of a path that are closer to the last one it kept than a distance.
class SpacingFilter {
 public:
  explicit SpacingFilter(double spacing_m) : spacing_m_(spacing_m) {}

  bool keeps(const Eigen::Vector2d& position_m) {
    if ((position_m - last_m_).norm() < spacing_m_) return false;
    last_m_ = position_m;
    return true;
  }

 private:
  double spacing_m_;
  Eigen::Vector2d last_m_ = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());  ///< none yet
};

/// Of a landmark's offset from the camera, metres: nothing that a camera measures is farther.
constexpr double kLongestOffset_m = 1e5;

/// Refuses what no adjustment finds out about an image with `feature_count` features: numbers that are not finite, a
/// position beyond kLargestCoordinate_m, a rotation that is not of unit length, a covariance that is none or does not
/// fit into floats, an offset longer than kLongestOffset_m, features that are not there or not in order. Throws
/// std::runtime_error.
void requireUsable(const ImageGeometry& geometry, std::size_t feature_count);

/// Of the image's features keeps those with these indices, which are in order, and the landmarks that they show.
void keepFeatures(const std::vector<std::size_t>& kept, TrainingImage& image);

/// Where the robot was at the images of a session: by the pose of its camera where landmarks tell it. Between two such
/// images, at most 30 m apart along the path, the others move as these do, in proportion to the time: fixes bend aside
/// for longer than a few images show nothing. `by_antenna`: the path by fixes, in order of time.
std::vector<TrajectoryPoint> adjustedPath(const std::vector<TrajectoryPoint>& by_antenna, const SensorMount& mount,
                                          const std::vector<std::optional<ImageGeometry>>& images);

/// The image is where the robot was by the pose of its camera.
void placeByCamera(TrainingImage& image, const SensorMount& mount, ImageGeometry geometry);

/// Landmarks and poses of the sessions that have a camera, from their images, which follow each other session by
/// session. Not pruned: what only images farther apart have in common holds the path together as well. `fixes` and
/// `clock_sigmas_s`: of each session.
std::vector<std::optional<SessionGeometry>> geometryOf(const TrainingMap& unpruned,
                                                       const std::vector<Session>& sessions,
                                                       const std::vector<std::vector<MapFix>>& fixes,
                                                       const std::vector<double>& clock_sigmas_s,
                                                       const GeometryConfig& config, std::size_t threads);

/// Cameras of the sessions that have none, by their images: see calibrateByImages() of a single one.
std::vector<std::optional<CameraModel>> calibrateByImages(const TrainingMap& unpruned,
                                                          const std::vector<Session>& sessions,
                                                          const std::vector<std::vector<MapFix>>& fixes,
                                                          const GeometryConfig& config, std::size_t threads);

/// Gives the images to `sink` where the adjustment has the robot, each after `prune`, but for those that are too close
/// to the one before (map/spacing, geometry/spacing); the number of these is returned.
std::size_t writeThinned(const TrainingMap& unpruned, const std::vector<Session>& sessions,
                         std::vector<std::optional<SessionGeometry>> geometries, const MapBuilderConfig& config,
                         const std::function<void(std::size_t i, TrainingImage&)>& prune,
                         const std::function<void(const TrainingImage&)>& sink);

}  // namespace visual_localization

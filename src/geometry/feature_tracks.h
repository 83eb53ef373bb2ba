#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/features/feature_matcher.h"
#include "visual_localization/geo/trajectory.h"
#include "visual_localization/geometry/camera_pose.h"

namespace visual_localization {

/// An image on the cleaned path of its session.
struct PathImage {
  std::uint32_t session = 0;
  TrajectoryPoint at;
};

/// Pairs of images, the smaller index first, that may show the same from about the same position, though they were not
/// recorded one after the other: of different sessions, or of one that comes back after a while. Each image is paired
/// with the nearest one that faces alike of each such visit, with three of them at most. Images of a session follow
/// each other.
std::vector<std::pair<std::uint32_t, std::uint32_t>> revisits(const std::vector<PathImage>& images);

/// One thing in the world as an image shows it.
struct FeatureObservation {
  std::uint32_t image = 0;
  std::uint32_t feature = 0;
};

/// The images that show one thing, in their order.
using FeatureTrack = std::vector<FeatureObservation>;

/// Verified matches of two images.
struct ImagePair {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
  std::vector<FeatureMatch> matches;
};

/// The features of images, joined where matches say that they show the same thing: four bytes a feature stay of all
/// matches.
class FeatureSets {
 public:
  /// Appends an image; its features are joined with none.
  void addImage(std::size_t features);
  /// Appends the images of another one, joined as they are there.
  void append(const FeatureSets& other);
  /// Joins the features of each match. The result does not depend on the order of the pairs.
  void join(const ImagePair& pair);
  /// Things that at least `min_views` images show, in order of the first observation. A set with two features of one
  /// image joins different things: it is left out.
  std::vector<FeatureTrack> tracks(std::size_t min_views) const;

 private:
  std::vector<std::uint32_t> ends_;     ///< behind the last feature of each image, numbered over all images
  std::vector<std::uint32_t> parents_;  ///< of each feature: a smaller one of its set, or itself
};

/// Cuts a track into pieces of about the same length, with at most `max_views` images of a session each. A piece has
/// what all sessions see on the same stretch, if they drive the same way. `session_of_image`: increasing.
std::vector<FeatureTrack> cutTrack(const FeatureTrack& track, std::size_t max_views,
                                   const std::function<std::size_t(std::uint32_t image)>& session_of_image);

/// A ray from a camera towards a point.
struct Sight {
  const CameraPose* camera = nullptr;
  Eigen::Vector2d normalised = Eigen::Vector2d::Zero();  ///< x/z, y/z in the camera's frame
};

/// The point nearest to all rays (least squares), map frame, metres. Nothing when the rays are all but parallel, the
/// widest angle between two of them below `min_angle_rad`, or when the point is behind a camera.
std::optional<Eigen::Vector3d> triangulate(const std::vector<Sight>& sights, double min_angle_rad);

}  // namespace visual_localization

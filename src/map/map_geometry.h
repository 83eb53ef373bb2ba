#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "geometry/session_geometry.h"
#include "visual_localization/geometry/image_geometry.h"
#include "visual_localization/map/map_builder.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

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

/// The image is where the robot was by the pose of its camera.
void placeByCamera(TrainingImage& image, const SensorMount& mount, ImageGeometry geometry);

/// Landmarks and poses of the sessions that have a camera, from their pruned images, which follow each other session by
/// session. `fixes`: of each session.
std::vector<std::optional<SessionGeometry>> geometryOf(const TrainingMap& pruned, const std::vector<Session>& sessions,
                                                       const std::vector<std::vector<MapFix>>& fixes,
                                                       const GeometryConfig& config, std::size_t threads);

/// Cameras of the sessions that have none, by their images: see calibrateByImages() of a single one.
std::vector<std::optional<CameraModel>> calibrateByImages(const TrainingMap& pruned,
                                                          const std::vector<Session>& sessions,
                                                          const std::vector<std::vector<MapFix>>& fixes,
                                                          const GeometryConfig& config, std::size_t threads);

/// Gives the images to `sink` where the adjustment has the robot, but for those that are too close to the one before
/// (map/spacing, geometry/spacing); the number of these is returned.
std::size_t writeThinned(const TrainingMap& pruned, const std::vector<Session>& sessions,
                         std::vector<std::optional<SessionGeometry>> geometries, const MapBuilderConfig& config,
                         const std::function<void(const TrainingImage&)>& sink);

}  // namespace visual_localization

#pragma once

#include <utility>

#include "visual_localization/geometry/sensor_mount.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// The image is where the robot was by the pose of its camera.
inline void placeByCamera(TrainingImage& image, const SensorMount& mount, ImageGeometry geometry) {
  const Eigen::Isometry3d base = mount.baseInMap(geometry.camera);
  image.position_m = base.translation().head<2>();
  image.yaw_rad = yawOf(base);
  image.geometry = std::move(geometry);
}

}  // namespace visual_localization

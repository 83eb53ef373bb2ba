#pragma once

#include <algorithm>
#include <cstdint>
#include <random>
#include <vector>

#include "test/support/landmark_world.h"

namespace visual_localization::test {

constexpr double kFixNoise_m = 0.15;
constexpr double kDensity = 5.0;  ///< points for a metre of street

// The median of five fixes to 0.15 m is good to 0.08 m in either axis. Shift and turn of the whole path average over 45
// of them: 0.03 m. The images' own errors along the path add as much.
constexpr double kPathError_m = 0.1;

inline RecordedDrive recorded(const StreetDrive& street, std::uint32_t seed,
                              const CameraModel& camera = streetCamera()) {
  std::mt19937 random(seed);
  const auto poses = drive(street);
  return record(poses, pointsAlong(poses, kDensity, random), kFixNoise_m, random, camera);
}

inline SessionGeometry adjusted(const RecordedDrive& drive) {
  return adjustSessions({drive.unadjusted()}, {}, 1).front();
}

inline std::size_t imagesIn(const SessionGeometry& geometry) {
  return static_cast<std::size_t>(std::count_if(geometry.images.begin(), geometry.images.end(),
                                                [](const auto& image) { return image.has_value(); }));
}

/// Root mean square over the images that have a geometry.
inline double pathError_m(const SessionGeometry& geometry, const std::vector<DrivenPose>& truth) {
  std::vector<Eigen::Vector2d> positions_m;
  std::vector<DrivenPose> then;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (!geometry.images[i]) continue;
    positions_m.emplace_back(geometry.images[i]->camera.position_m.head<2>());
    then.push_back(truth[i]);
  }
  return pathError_m(positions_m, then);
}

}  // namespace visual_localization::test

#include "visual_localization/geometry/camera_pose.h"

#include <cmath>

#include <gtest/gtest.h>

namespace visual_localization {
namespace {

TEST(CameraPose, AnUprightCameraLooksAlongTheRoad) {
  const Eigen::Vector3d ahead = uprightCamera(0.5, 0.1) * Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(ahead.z() / ahead.head<2>().norm(), 0.1, 1e-12);
  EXPECT_NEAR(std::atan2(ahead.y(), ahead.x()), 0.5, 1e-12);
  const Eigen::Vector3d right = uprightCamera(0.5, 0.1) * Eigen::Vector3d::UnitX();
  EXPECT_NEAR(right.z(), 0.0, 1e-12);
}

}  // namespace
}  // namespace visual_localization

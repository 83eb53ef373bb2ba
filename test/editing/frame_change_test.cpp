#include <cmath>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "editing/map_alignment.h"

namespace visual_localization {
namespace {

TEST(FrameChange, TheSameDatumChangesNothingAtAll) {
  const LocalFrame frame({48.5, 9.05, 430.0});
  const PoseCorrection change = FrameChange(frame, frame).at({123.4, -56.7});
  EXPECT_EQ(change.shift_m, Eigen::Vector3d::Zero());
  EXPECT_EQ(change.turn.coeffs(), Eigen::Quaterniond::Identity().coeffs());
}

TEST(FrameChange, KeepsWhereThingsAreOnTheEarth) {
  const LocalFrame from({48.50, 9.00, 430.0});
  const LocalFrame to({48.51, 9.02, 400.0});
  const Eigen::Vector2d here_m(250.0, -75.0);
  const PoseCorrection change = FrameChange(from, to).at(here_m);
  const GeodeticPoint before = from.toGeodetic(here_m);
  const GeodeticPoint after = to.toGeodetic(here_m + change.shift_m.head<2>());
  EXPECT_NEAR(after.latitude_deg, before.latitude_deg, 1e-10);
  EXPECT_NEAR(after.longitude_deg, before.longitude_deg, 1e-10);
  EXPECT_DOUBLE_EQ(change.shift_m.z(), 30.0);
}

TEST(FrameChange, NorthIsAnotherDirectionFurtherWest) {
  const LocalFrame from({60.0, 9.0, 0.0});
  const LocalFrame to({60.0, 10.0, 0.0});
  // Meridians meet at the pole: north leans to the east by sin(latitude) times the difference of longitude.
  const CameraPose north{levelCamera(0.5 * kPi), Eigen::Vector3d::Zero()};
  const double turned_rad = FrameChange(from, to).at({0.0, 0.0}).of(north).yaw_rad() - north.yaw_rad();
  EXPECT_NEAR(turned_rad, -std::sin(kPi / 3.0) * kPi / 180.0, 1e-4);
}

}  // namespace
}  // namespace visual_localization

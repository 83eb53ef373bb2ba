// Sessions with more images than are adjusted at a time.

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "test/geometry/recorded_street.h"

namespace visual_localization {
namespace {

using test::DrivenPose;
using test::imagesIn;
using test::kDensity;
using test::kFixNoise_m;
using test::kPathError_m;
using test::pathError_m;
using test::recorded;
using test::RecordedDrive;

GeometryConfig windowsOf(int images) {
  GeometryConfig config;
  config.window = images;
  return config;
}

test::StreetDrive streetOf(std::size_t images) {
  test::StreetDrive street;
  street.images = images;
  return street;
}

test::StreetDrive longStreet() { return streetOf(400); }

/// The largest error of the way from one image to the next.
double largestStepError_m(const SessionGeometry& geometry, const std::vector<DrivenPose>& truth) {
  double largest_m = 0.0;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const Eigen::Vector3d way = geometry.images[i]->camera.position_m - geometry.images[i - 1]->camera.position_m;
    const Eigen::Vector3d true_way = truth[i].camera.position_m - truth[i - 1].camera.position_m;
    largest_m = std::max(largest_m, (way - true_way).norm());
  }
  return largest_m;
}

TEST(SessionWindows, JoinWithoutASeam) {
  const RecordedDrive drive = recorded(longStreet(), 51);
  const SessionGeometry whole = adjustSessions({drive.unadjusted()}, {}, 1).front();
  const SessionGeometry parts = adjustSessions({drive.unadjusted()}, windowsOf(200), 1).front();
  ASSERT_EQ(imagesIn(whole), drive.truth.size());
  ASSERT_EQ(imagesIn(parts), drive.truth.size());
  EXPECT_LT(pathError_m(parts, drive.truth), kPathError_m);
  EXPECT_LT(largestStepError_m(parts, drive.truth), 1.5 * largestStepError_m(whole, drive.truth));
  EXPECT_NEAR(static_cast<double>(parts.observations), static_cast<double>(whole.observations),
              0.01 * static_cast<double>(whole.observations));
  EXPECT_NEAR(parts.median_error_px, whole.median_error_px, 0.05 * whole.median_error_px);
}

TEST(SessionWindows, AreOneForAShortSession) {
  const RecordedDrive drive = recorded({}, 52);
  const SessionGeometry usual = adjustSessions({drive.unadjusted()}, {}, 1).front();
  const SessionGeometry enough = adjustSessions({drive.unadjusted()}, windowsOf(200), 1).front();
  for (std::size_t i = 0; i < drive.truth.size(); ++i) {
    EXPECT_EQ(usual.images[i]->camera.position_m, enough.images[i]->camera.position_m);
  }
}

TEST(SessionWindows, BelieveTheImagesWhereFixesBend) {
  RecordedDrive drive = recorded(longStreet(), 53);
  test::bendFixes(drive, 0.4, 0.55, 8.0);
  const SessionGeometry whole = adjustSessions({drive.unadjusted()}, {}, 1).front();
  const SessionGeometry parts = adjustSessions({drive.unadjusted()}, windowsOf(200), 1).front();
  EXPECT_EQ(imagesIn(parts), drive.truth.size());
  EXPECT_LT(pathError_m(parts, drive.truth), pathError_m(whole, drive.truth) + kPathError_m);
}

TEST(SessionWindows, KnowHowHighTheStreetIs) {
  test::StreetDrive street = streetOf(280);
  street.slope = 0.05;
  const RecordedDrive drive = recorded(street, 54);
  const auto heightError_m = [&](const SessionGeometry& geometry) {
    double sum_m2 = 0.0;
    for (std::size_t i = 0; i < drive.truth.size(); ++i) {
      const double off_m = geometry.images[i]->camera.position_m.z() - drive.truth[i].camera.position_m.z();
      sum_m2 += off_m * off_m;
    }
    return std::sqrt(sum_m2 / static_cast<double>(drive.truth.size()));
  };
  const SessionGeometry whole = adjustSessions({drive.unadjusted()}, {}, 1).front();
  const SessionGeometry parts = adjustSessions({drive.unadjusted()}, windowsOf(200), 1).front();
  ASSERT_EQ(imagesIn(parts), drive.truth.size());
  EXPECT_LT(heightError_m(parts), heightError_m(whole) + 0.2);
}

TEST(SessionWindows, CorrectTheCalibration) {
  const RecordedDrive drive = recorded(streetOf(280), 55);
  Intrinsics wrong = drive.camera.intrinsics();
  wrong.fx *= 0.96;
  wrong.fy *= 0.96;
  const CameraModel camera(wrong);
  UnadjustedSession session = drive.unadjusted();
  session.camera = &camera;
  const SessionGeometry geometry = adjustSessions({session}, windowsOf(200), 1).front();
  EXPECT_FALSE(geometry.contradicts_calibration);
  EXPECT_NEAR(geometry.lens.fx, drive.camera.intrinsics().fx, 0.005 * wrong.fx);
}

/// Two drives along a street whose fixes are off by `bias_m`, one way and the other.
class TiedWindows : public testing::Test {
 protected:
  void SetUp() override {
    std::mt19937 random(56);
    auto poses = test::drive(streetOf(180));
    const auto world = test::pointsAlong(poses, kDensity, random);
    drives_.push_back(test::record(poses, world, kFixNoise_m, random));
    for (DrivenPose& pose : poses) pose.camera.position_m += pose.camera.rotation * Eigen::Vector3d(0.3, 0.0, 0.2);
    drives_.push_back(test::record(poses, world, kFixNoise_m, random));
    for (MapFix& fix : drives_[0].fixes) fix.position_m -= kBias_m;
    for (MapFix& fix : drives_[1].fixes) fix.position_m += kBias_m;
  }

  std::vector<SessionGeometry> tied(const GeometryConfig& config) const {
    return adjustSessions({drives_[0].unadjusted(), drives_[1].unadjusted()}, config, 1);
  }

  static const Eigen::Vector2d kBias_m;
  std::vector<RecordedDrive> drives_;
};

const Eigen::Vector2d TiedWindows::kBias_m(0.3, -0.2);

TEST_F(TiedWindows, PutOnePositionToOnePlace) {
  const auto sessions = tied(windowsOf(200));
  double apart_m = 0.0;
  double compared = 0.0;
  for (std::size_t i = 0; i < drives_[0].truth.size(); ++i) {
    if (!sessions[0].images[i] || !sessions[1].images[i]) continue;
    const auto error = [&](std::size_t k) {
      return sessions[k].images[i]->camera.position_m - drives_[k].truth[i].camera.position_m;
    };
    apart_m += (error(0) - error(1)).head<2>().norm();
    ++compared;
  }
  EXPECT_GT(compared, 0.9 * static_cast<double>(drives_[0].truth.size()));
  EXPECT_LT(apart_m / compared, 0.05);
}

// A window holds both sessions at a place, so that neither keeps the errors of its own fixes.
TEST_F(TiedWindows, AverageTheErrorsOfFixes) {
  const auto sessions = tied(windowsOf(200));
  for (std::size_t k = 0; k < sessions.size(); ++k) {
    EXPECT_LT(pathError_m(sessions[k], drives_[k].truth), 0.5 * kBias_m.norm());
  }
}

}  // namespace
}  // namespace visual_localization

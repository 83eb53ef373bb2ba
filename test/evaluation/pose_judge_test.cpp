#include <cmath>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "evaluation/metrics.h"

namespace visual_localization {
namespace {

constexpr float kTolerance = 1e-5F;

/// At (3, 4), looking north, with a claim of 1 m east and 2 m north.
Estimate estimateOf(PoseSource source, LocalizationState state) {
  Estimate estimate;
  estimate.stamp_ns = 1'500'000'000;
  estimate.source = source;
  estimate.state = state;
  estimate.pose.position_m = {3.0, 4.0};
  estimate.pose.yaw_rad = 0.5 * kPi;
  estimate.pose.covariance_m2 = Eigen::Vector2d(1.0, 4.0).asDiagonal();
  return estimate;
}

StepRecord judged(const Estimate& estimate, const std::optional<double>& true_yaw_rad,
                  const std::optional<MapError>& map_error = std::nullopt) {
  StepRecord step;
  judgePose(estimate, {1.0, 0.0}, true_yaw_rad, map_error, step);
  return step;
}

TEST(PoseJudge, MeasuresHeadingTheShorterWay) {
  Estimate estimate = estimateOf(PoseSource::kPlace, LocalizationState::kTracking);
  EXPECT_NEAR(judged(estimate, 0.25 * kPi).heading_err_deg, 45.0F, kTolerance);
  estimate.pose.yaw_rad = -kPi + 0.1;
  EXPECT_NEAR(judged(estimate, kPi - 0.1).heading_err_deg, 0.2 * 180.0 / kPi, 1e-4);
  EXPECT_TRUE(std::isnan(judged(estimate, std::nullopt).heading_err_deg));
}

TEST(PoseJudge, WeighsTheErrorByThePublishedCovariance) {
  // (2, 4) by 1 and 4 m2: 4 / 1 + 16 / 4
  EXPECT_NEAR(judged(estimateOf(PoseSource::kPlace, LocalizationState::kTracking), 0.0).nees, 8.0F, kTolerance);
  EXPECT_NEAR(judged(estimateOf(PoseSource::kMetric, LocalizationState::kUncertain), 0.0).nees, 8.0F, kTolerance);
  EXPECT_TRUE(std::isnan(judged(estimateOf(PoseSource::kPlace, LocalizationState::kUncertain), 0.0).nees));
}

TEST(PoseJudge, ACovarianceWithoutRoomIsNoPerfectClaim) {
  Estimate estimate = estimateOf(PoseSource::kMetric, LocalizationState::kTracking);
  estimate.pose.covariance_m2.setZero();
  const float nees = judged(estimate, 0.0).nees;
  EXPECT_TRUE(std::isfinite(nees));
  EXPECT_GT(nees, 1e6F);
}

TEST(PoseJudge, InRelationToTheMapItsErrorDoesNotCount) {
  Estimate estimate = estimateOf(PoseSource::kMetric, LocalizationState::kTracking);
  estimate.metric.emplace();
  estimate.metric->covariance.diagonal().head<2>().setConstant(0.25);
  const StepRecord step = judged(estimate, 0.25 * kPi, MapError{{1.0, 3.5}, 0.2 * kPi});
  EXPECT_NEAR(step.relative.heading_deg, 9.0F, 1e-4);
  EXPECT_NEAR(step.relative.nees, (1.0F + 0.25F) / 0.25F, kTolerance);
  EXPECT_TRUE(std::isnan(judged(estimate, 0.25 * kPi).relative.nees));
  EXPECT_TRUE(std::isnan(judged(estimate, 0.25 * kPi, MapError{}).relative.heading_deg));
}

TEST(PoseJudge, WritesPlacesAsLevelTumPoses) {
  EXPECT_EQ(tumLine(1'500'000'000, {3.0, -4.5}, 0.0), "1.500000000 3 -4.5 0 0 0 0 1");
  Estimate estimate = estimateOf(PoseSource::kPlace, LocalizationState::kTracking);
  estimate.pose.yaw_rad = kPi;
  EXPECT_EQ(tumLine(estimate).rfind("1.500000000 3 4 0 0 0 1 ", 0), 0U) << tumLine(estimate);
}

TEST(PoseJudge, WritesSolvedPosesWithXAhead) {
  Estimate estimate = estimateOf(PoseSource::kMetric, LocalizationState::kTracking);
  estimate.metric.emplace();
  estimate.metric->base = SensorMount().baseInMap({levelCamera(0.5 * kPi), {1.0, 2.0, 0.5}});
  std::istringstream in(tumLine(estimate));
  double stamp = 0.0;
  Eigen::Vector3d position;
  Eigen::Quaterniond rotation;
  in >> stamp >> position.x() >> position.y() >> position.z() >> rotation.x() >> rotation.y() >> rotation.z() >>
      rotation.w();
  EXPECT_TRUE(position.isApprox(Eigen::Vector3d(1.0, 2.0, 0.5)));
  EXPECT_TRUE((rotation * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY(), 1e-9));
  EXPECT_TRUE((rotation * Eigen::Vector3d::UnitZ()).isApprox(Eigen::Vector3d::UnitZ(), 1e-9));
}

}  // namespace
}  // namespace visual_localization

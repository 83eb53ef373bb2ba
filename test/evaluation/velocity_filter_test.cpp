#include <cmath>
#include <random>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "evaluation/metrics.h"
#include "test/support/stamps.h"

namespace visual_localization {
namespace {

using test::kSecond_ns;

constexpr double kSigma_m = 0.05;
const Eigen::Matrix2d kCovariance_m2 = kSigma_m * kSigma_m * Eigen::Matrix2d::Identity();

TEST(VelocityFilter, ThrowsNothingAwayOfTheFirstPosition) {
  VelocityFilter filter;
  filter.add(5 * kSecond_ns, {3.0, -4.0}, kCovariance_m2);
  EXPECT_EQ(filter.position_m(), Eigen::Vector2d(3.0, -4.0));
  EXPECT_TRUE(filter.covariance_m2().isApprox(kCovariance_m2));
}

TEST(VelocityFilter, KnowsASteadyMotionBetterThanASinglePosition) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, kSigma_m);
  VelocityFilter filter;
  double squared_m2 = 0.0;
  double nees = 0.0;
  constexpr int kImages = 2000;
  for (int i = 0; i < kImages; ++i) {
    const Eigen::Vector2d truth_m(0.13 * i, -0.05 * i);
    const double east_m = noise(random);
    filter.add(i * kSecond_ns / 5, truth_m + Eigen::Vector2d(east_m, noise(random)), kCovariance_m2);
    const Eigen::Vector2d error_m = filter.position_m() - truth_m;
    squared_m2 += error_m.squaredNorm();
    nees += error_m.dot(filter.covariance_m2().inverse() * error_m);
  }
  EXPECT_LT(std::sqrt(squared_m2 / kImages), 0.8 * std::sqrt(2.0) * kSigma_m);
  EXPECT_LT(nees / kImages, 2.0) << "the motion is steadier than the filter thinks";
}

TEST(VelocityFilter, BeginsAnewAfterAPauseAndAtAnotherPlace) {
  VelocityFilter filter;
  for (int i = 0; i < 10; ++i) filter.add(i * kSecond_ns, {1.0 * i, 0.0}, kCovariance_m2);
  EXPECT_LT(filter.covariance_m2()(0, 0), kCovariance_m2(0, 0));
  filter.add(10 * kSecond_ns, {80.0, 40.0}, kCovariance_m2);
  EXPECT_EQ(filter.position_m(), Eigen::Vector2d(80.0, 40.0));
  filter.add(30 * kSecond_ns, {80.1, 40.0}, kCovariance_m2);
  EXPECT_EQ(filter.position_m(), Eigen::Vector2d(80.1, 40.0));
  filter.add(29 * kSecond_ns, {80.2, 40.0}, kCovariance_m2);
  EXPECT_EQ(filter.position_m(), Eigen::Vector2d(80.2, 40.0));
}

}  // namespace
}  // namespace visual_localization

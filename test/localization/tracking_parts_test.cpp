#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "localization/image_likelihood.h"
#include "test/support/synthetic.h"
#include "visual_localization/localization/particles.h"
#include "visual_localization/localization/tracker.h"

namespace visual_localization {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const double kNan = std::nan("");

Particle particleAt(double x, double y, double weight) {
  Particle particle;
  particle.position_m = {x, y};
  particle.weight = weight;
  return particle;
}

TEST(Fitness, IsTheWeightTimesAGaussianOfTheDistance) {
  const auto map = test::mapAt({{0.0, 0.0}, {100.0, 0.0}});
  Scores scores(2);
  scores.startImage(FeatureKind::kLocal, [](FeatureKind, std::size_t image) {
    return Score{1.0, image == 0 ? 0.4 : 0.8, 10, true};
  });
  LocalizerConfig config;
  config.fitness.distance_sigma_m = 5.0;
  MapSweep sweep(*map, 100, 100);
  const SessionChoice sessions(*map, false);
  ImageLikelihood likelihood(scores, sweep, sessions, config);
  EXPECT_DOUBLE_EQ(likelihood.at({0.0, 0.0}).value, 0.4);
  const Fitness beside = likelihood.at({97.0, 4.0});
  EXPECT_EQ(beside.training_image, 1u);
  EXPECT_DOUBLE_EQ(beside.value, 0.8 * std::exp(-0.5));
  EXPECT_EQ(scores.comparisons(), 2u);
}

TEST(Fitness, TheExponentOfGlobalFeaturesMayRaiseTheWholeProduct) {
  const auto map = test::mapAt({{0.0, 0.0}, {100.0, 0.0}});
  const double m = 0.9;
  for (const FeatureKind kind : {FeatureKind::kGlobal, FeatureKind::kLocal}) {
    Scores scores(2);
    const double exponent = kind == FeatureKind::kGlobal ? 20.0 : 1.0;
    scores.startImage(kind, [&](FeatureKind, std::size_t) { return Score{m, std::pow(m, exponent), 0, true}; });
    LocalizerConfig config;
    config.match.mode = "symmetric";
    config.fitness.sharpen = "product";
    config.fitness.distance_sigma_m = 5.0;
    MapSweep sweep(*map, 100, 100);
    const SessionChoice sessions(*map, false);
    ImageLikelihood likelihood(scores, sweep, sessions, config);
    const double zeta = std::exp(-0.5 * 4.0 * 4.0 / (5.0 * 5.0));
    EXPECT_NEAR(likelihood.at({0.0, 4.0}).value, std::pow(m * zeta, exponent), 1e-12);
  }
}

TEST(Cloud, MomentsOfAKnownCloud) {
  const std::vector<Particle> cloud{particleAt(0.0, 0.0, 0.25), particleAt(4.0, 2.0, 0.75)};
  const CloudMoments moments = momentsOf(cloud);
  EXPECT_DOUBLE_EQ(moments.mean_m.x(), 3.0);
  EXPECT_DOUBLE_EQ(moments.mean_m.y(), 1.5);
  EXPECT_DOUBLE_EQ(moments.covariance_m2(0, 0), 0.25 * 9.0 + 0.75 * 1.0);
  EXPECT_DOUBLE_EQ(moments.covariance_m2(0, 1), 0.25 * 4.5 + 0.75 * 0.5);
  EXPECT_DOUBLE_EQ(moments.spread().x(), std::sqrt(3.0));
}

TEST(Cloud, MomentsNeedNoWeightsOfSumOne) {
  std::vector<Particle> cloud(2);
  cloud[0].position_m = {1.0, 0.0};
  cloud[1].position_m = {3.0, 0.0};
  for (Particle& particle : cloud) particle.weight = 0.1;
  const CloudMoments moments = momentsOf(cloud);
  EXPECT_NEAR(moments.mean_m.x(), 2.0, 1e-12);
  EXPECT_NEAR(moments.covariance_m2(0, 0), 1.0, 1e-12);
}

TEST(Cloud, CovarianceOfAModeIgnoresTheRest) {
  const std::vector<Particle> cloud{particleAt(1.0, 0.0, 0.2), particleAt(-1.0, 0.0, 0.2), particleAt(50.0, 0.0, 0.6)};
  EXPECT_DOUBLE_EQ(covarianceAbout({0.0, 0.0}, cloud, 5.0)(0, 0), 1.0);
  EXPECT_GT(covarianceAbout({0.0, 0.0}, cloud)(0, 0), 1000.0);
  EXPECT_EQ(covarianceAbout({0.0, 30.0}, cloud, 5.0), Eigen::Matrix2d::Zero());
}

TEST(Cloud, NormalisingNeedsSomethingToNormalise) {
  std::vector<Particle> cloud{particleAt(0, 0, 1.0), particleAt(0, 0, 3.0)};
  normaliseWeights(cloud);
  EXPECT_DOUBLE_EQ(cloud[1].weight, 0.75);
  for (const double useless : {0.0, kNan, kInfinity}) {
    cloud[0].weight = cloud[1].weight = useless;
    normaliseWeights(cloud);
    EXPECT_DOUBLE_EQ(cloud[0].weight, 0.5);
  }
}

TEST(Prior, AnywhereFillsTheArea) {
  const Prior prior = anywhere({{-10.0, 5.0}, {30.0, 5.0}});
  Random random(1);
  double lowest = kInfinity;
  double highest = -kInfinity;
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector2d position = prior(random);
    EXPECT_EQ(position.y(), 5.0);
    lowest = std::min(lowest, position.x());
    highest = std::max(highest, position.x());
  }
  EXPECT_GE(lowest, -10.0);
  EXPECT_LT(lowest, -9.0);
  EXPECT_LE(highest, 30.0);
  EXPECT_GT(highest, 29.0);
}

TEST(Prior, DiscIsUniform) {
  const Prior prior = around({1.0, 2.0}, 4.0);
  Random random(2);
  int inner = 0;
  for (int i = 0; i < 4000; ++i) {
    const double distance = (prior(random) - Eigen::Vector2d(1.0, 2.0)).norm();
    EXPECT_LE(distance, 4.0);
    inner += distance < 2.0 ? 1 : 0;
  }
  EXPECT_NEAR(inner, 1000, 120);  // a quarter of the area
}

TEST(Prior, NormalHasTheGivenMoments) {
  Eigen::Matrix2d covariance;
  covariance << 4.0, 1.5, 1.5, 1.0;
  const Prior prior = normallyDistributed({10.0, -5.0}, covariance);
  Random random(3);
  std::vector<Particle> draws;
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector2d position = prior(random);
    draws.push_back(particleAt(position.x(), position.y(), 1.0 / 20000.0));
  }
  const CloudMoments moments = momentsOf(draws);
  EXPECT_LT((moments.mean_m - Eigen::Vector2d(10.0, -5.0)).norm(), 0.1);
  EXPECT_LT((moments.covariance_m2 - covariance).cwiseAbs().maxCoeff(), 0.15);
}

TEST(Prior, RefusesWhatIsNoDistribution) {
  Eigen::Matrix2d negative;
  negative << 1.0, 2.0, 2.0, 1.0;
  Eigen::Matrix2d asymmetric;
  asymmetric << 1.0, 0.5, 0.0, 1.0;
  EXPECT_THROW(normallyDistributed({0.0, 0.0}, negative), std::invalid_argument);
  EXPECT_THROW(normallyDistributed({0.0, 0.0}, asymmetric), std::invalid_argument);
  EXPECT_THROW(normallyDistributed({kNan, 0.0}, Eigen::Matrix2d::Identity()), std::invalid_argument);
  EXPECT_THROW(normallyDistributed({0.0, 0.0}, kInfinity * Eigen::Matrix2d::Ones()), std::invalid_argument);
  EXPECT_THROW(around({0.0, 0.0}, -1.0), std::invalid_argument);
  EXPECT_THROW(around({0.0, 0.0}, kNan), std::invalid_argument);
  EXPECT_THROW(around({0.0, kInfinity}, 1.0), std::invalid_argument);
  EXPECT_THROW(around({kNan, 0.0}, 1.0), std::invalid_argument);
  EXPECT_NO_THROW(normallyDistributed({0.0, 0.0}, Eigen::Matrix2d::Zero()));
}

TEST(Prior, RefusesWhatIsLargerThanAnyLocalMap) {
  constexpr double kLargest_m = 1e6;
  constexpr double kBeyond_m = 1.001e6;
  EXPECT_NO_THROW(around({-kLargest_m, kLargest_m}, kLargest_m));
  EXPECT_THROW(around({-kBeyond_m, 0.0}, 1.0), std::invalid_argument);
  EXPECT_THROW(around({0.0, 0.0}, kBeyond_m), std::invalid_argument);
  const Eigen::Matrix2d one = Eigen::Matrix2d::Identity();
  EXPECT_NO_THROW(normallyDistributed({-kLargest_m, kLargest_m}, kLargest_m * kLargest_m * one));
  EXPECT_THROW(normallyDistributed({0.0, kBeyond_m}, one), std::invalid_argument);
  EXPECT_THROW(normallyDistributed({0.0, 0.0}, kBeyond_m * kBeyond_m * one), std::invalid_argument);
}

TEST(Fitness, AboutAVerifiedPositionIsAGaussianOfAMetre) {
  const auto map = test::mapAt({{0.0, 0.0}, {10.0, 0.0}, {20.0, 0.0}});
  PoseLikelihood likelihood(*map, {1.0, 2.0});
  EXPECT_DOUBLE_EQ(likelihood.at({1.0, 2.0}).value, 1.0);
  EXPECT_TRUE(likelihood.at({1.0, 2.0}).score.recognised);
  EXPECT_DOUBLE_EQ(likelihood.at({4.0, 6.0}).value, std::exp(-12.5));
  EXPECT_EQ(likelihood.peak_m(), Eigen::Vector2d(1.0, 2.0));
  EXPECT_DOUBLE_EQ(likelihood.of(0).weight, std::exp(-2.5)) << "of the position of a training image";
  Random random(1);
  EXPECT_EQ(likelihood.draw(random), 0U);
  EXPECT_EQ(likelihood.mostSimilar(2), (std::vector<std::size_t>{0, 1}));
}

TEST(Cloud, ScatterCountsAllAlike) {
  const std::vector<Particle> cloud{particleAt(0.0, 0.0, 0.9), particleAt(4.0, 2.0, 0.1)};
  Eigen::Matrix2d expected;
  expected << 0.5 * (1.0 + 9.0), 0.5 * (1.0 + 3.0), 0.5 * (1.0 + 3.0), 0.5 * (1.0 + 1.0);
  EXPECT_LT((scatterAbout({1.0, 1.0}, cloud) - expected).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(scatterAbout({1.0, 1.0}, {}), Eigen::Matrix2d::Zero());
}

TEST(Cloud, WithoutWeightsItHasNoMoments) {
  const CloudMoments moments = momentsOf({particleAt(3.0, 0.0, 0.0), particleAt(5.0, 1.0, 0.0)});
  EXPECT_EQ(moments.mean_m, Eigen::Vector2d(0.0, 0.0));
  EXPECT_EQ(moments.covariance_m2, Eigen::Matrix2d::Zero().eval());
}

TEST(Prior, ADiscReachesAllAround) {
  const Prior prior = around({10.0, 20.0}, 4.0);
  Random random(4);
  int quadrants[4] = {};
  for (int i = 0; i < 4000; ++i) {
    const Eigen::Vector2d offset_m = prior(random) - Eigen::Vector2d(10.0, 20.0);
    ++quadrants[(offset_m.x() > 0.0 ? 1 : 0) + (offset_m.y() > 0.0 ? 2 : 0)];
  }
  for (const int count : quadrants) EXPECT_NEAR(count, 1000, 150);
}

TEST(Prior, SymmetryIsAskedForInRelationToTheSize) {
  Eigen::Matrix2d large = 1e6 * Eigen::Matrix2d::Identity();
  large(0, 1) = 1000.0;
  large(1, 0) = 1000.5;  // half a millionth of the largest
  EXPECT_NO_THROW(normallyDistributed({0.0, 0.0}, large));
  Eigen::Matrix2d small = 1e-4 * Eigen::Matrix2d::Identity();
  small(0, 1) = 5e-7;  // nothing beside one square metre
  EXPECT_NO_THROW(normallyDistributed({0.0, 0.0}, small));
  large(1, 0) = 1003.0;
  EXPECT_THROW(normallyDistributed({0.0, 0.0}, large), std::invalid_argument);
}

}  // namespace
}  // namespace visual_localization

#include "geometry/fix_budget.h"

#include <cmath>
#include <random>
#include <string>

#include <gtest/gtest.h>

namespace visual_localization {
namespace {

constexpr double kSigma_m = 0.8;
constexpr double kDuration_s = 400.0;
constexpr double kInside95 = 5.991;  ///< squared sigmas of two axes

/// Errors of a receiver: white noise, and a Gauss-Markov process that keeps for `correlation_s`.
std::vector<FixResidual> errorsOf(double correlation_s, double white_share, double step_s, std::mt19937& random) {
  std::normal_distribution<double> normal(0.0, kSigma_m);
  const auto draw = [&] { return Eigen::Vector2d(normal(random), normal(random)); };
  const double keeps = correlation_s > 0.0 ? std::exp(-step_s / correlation_s) : 0.0;
  Eigen::Vector2d slow = draw();
  std::vector<FixResidual> errors;
  for (int i = 0; i * step_s < kDuration_s; ++i) {
    errors.push_back({i * step_s, std::sqrt(1.0 - white_share) * slow + std::sqrt(white_share) * draw(), kSigma_m});
    slow = keeps * slow + std::sqrt(1.0 - keeps * keeps) * draw();
  }
  return errors;
}

/// What is left of them when a rigid path lies in their middle; returns how far that is off.
Eigen::Vector2d takeMean(std::vector<FixResidual>& errors) {
  Eigen::Vector2d mean_m = Eigen::Vector2d::Zero();
  for (const FixResidual& error : errors) mean_m += error.off_m / static_cast<double>(errors.size());
  for (FixResidual& error : errors) error.off_m -= mean_m;
  return mean_m;
}

double shareInside(double correlation_s, double white_share, double step_s) {
  constexpr int kRuns = 300;
  std::mt19937 random(3);
  int inside = 0;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<FixResidual> residuals = errorsOf(correlation_s, white_share, step_s, random);
    const Eigen::Vector2d off_m = takeMean(residuals);
    const double sigma_m = fixBudget(residuals).sigma_m;
    if (off_m.squaredNorm() < kInside95 * sigma_m * sigma_m) ++inside;
  }
  return static_cast<double>(inside) / kRuns;
}

// 300 runs: a share of 0.95 has a sigma of 0.013. The budget is to be honest whatever the correlation time, and no
// safer than it must.
TEST(FixBudget, IsHonestWhateverTheCorrelationTimeOfTheReceiver) {
  for (const double correlation_s : {0.0, 10.0, 60.0, 300.0, 1800.0}) {
    const double inside = shareInside(correlation_s, 0.0, 1.0);
    EXPECT_GE(inside, 0.90) << correlation_s;
    EXPECT_LE(inside, 0.99) << correlation_s;
  }
}

TEST(FixBudget, SeesASlowErrorThroughWhiteNoise) {
  for (const double correlation_s : {10.0, 60.0, 300.0, 1800.0}) {
    EXPECT_GE(shareInside(correlation_s, 0.5, 0.2), 0.90) << correlation_s;
    EXPECT_GE(shareInside(correlation_s, 0.9, 0.2), 0.88) << correlation_s << ", mostly white noise";
  }
}

TEST(FixBudget, OfWhiteNoiseIsThatOfAMean) {
  std::mt19937 random(4);
  std::vector<FixResidual> residuals = errorsOf(0.0, 1.0, 1.0, random);
  takeMean(residuals);
  const FixBudget budget = fixBudget(residuals);
  EXPECT_NEAR(budget.declared_m, kSigma_m, 1e-12);
  EXPECT_NEAR(budget.residual_m, kSigma_m, 0.1);
  EXPECT_NEAR(budget.correlation_s, 1.0, 0.3);
  EXPECT_DOUBLE_EQ(budget.duration_s, kDuration_s);
  EXPECT_LT(budget.sigma_m, 0.3 * kSigma_m);
}

TEST(FixBudget, BelievesWhatTheReceiverClaimsWhereNothingShows) {
  std::vector<FixResidual> residuals;
  for (int i = 0; i < 100; ++i) residuals.push_back({1.0 * i, {5.0, -3.0}, kSigma_m});
  EXPECT_DOUBLE_EQ(fixBudget(residuals).sigma_m, kSigma_m) << "what is the same throughout is no residual";
  EXPECT_DOUBLE_EQ(fixBudget({{0.0, {1.0, 1.0}, 0.5}}).sigma_m, 0.5) << "nor is that of one fix";
  EXPECT_DOUBLE_EQ(fixBudget({}).sigma_m, 0.0);
}

TEST(FixBudget, FewOutliersShowNoSlowErrors) {
  std::vector<FixResidual> residuals;
  for (int i = 0; i < 400; ++i) {
    residuals.push_back({1.0 * i, {i % 40 == 0 ? 50.0 : 0.0, i % 40 == 20 ? -50.0 : 0.0}, kSigma_m});
  }
  EXPECT_GT(fixBudget(residuals).sigma_m, 0.8 * kSigma_m);
}

TEST(FixBudget, CountsWhatIsAlikeBeyondTheClaimAsABendOfThePath) {
  std::mt19937 random(6);
  std::vector<FixResidual> residuals = errorsOf(5.0, 0.0, 0.5, random);
  for (FixResidual& residual : residuals) residual.sigma_m = kSigma_m / 2.0;
  EXPECT_GT(fixBudget(residuals).sigma_m, 0.6 * kSigma_m) << "of the sqrt(3/4) that the claim does not explain";
  residuals = errorsOf(0.0, 1.0, 0.2, random);
  for (FixResidual& residual : residuals) residual.sigma_m = kSigma_m / 2.0;
  EXPECT_LT(fixBudget(residuals).sigma_m, 0.2 * kSigma_m) << "white noise bends no path";
}

TEST(FixBudget, CountsNoPauseAsTimeWithFixes) {
  std::mt19937 random(5);
  std::vector<FixResidual> residuals = errorsOf(60.0, 0.0, 1.0, random);
  takeMean(residuals);
  const FixBudget whole = fixBudget(residuals);
  for (std::size_t i = residuals.size() / 2; i < residuals.size(); ++i) residuals[i].time_s += 1e5;
  const FixBudget paused = fixBudget(residuals);
  EXPECT_DOUBLE_EQ(paused.duration_s, whole.duration_s);
  EXPECT_NEAR(paused.sigma_m, whole.sigma_m, 0.1 * whole.sigma_m);
}

TEST(FixBudget, FindsHowLongAReceiverErrsAlike) {
  const auto of = [](double x) {  // share of the variance that a mean keeps
    const double share = 2.0 * (x - 1.0 + std::exp(-x)) / (x * x);
    return receiverCorrelation_s({1.0, false, 0.0, 0.0, 400.0, std::sqrt(share)});
  };
  for (const double x : {0.25, 1.0, 4.0, 40.0}) EXPECT_NEAR(of(x) * x / 400.0, 1.0, 0.1) << x;
  EXPECT_DOUBLE_EQ(receiverCorrelation_s({1.0, false, 0.0, 0.0, 400.0, 1.0}), 3600.0);
}

TEST(FixBudget, SaysWhenTheAdjustmentLeavesMoreOpen) {
  const auto saysMore = [](double sigma_m) {
    return describe(FixBudget{0.05, false, 0.02, 1.0, 6.0, sigma_m}).find("the adjustment leaves more open") !=
           std::string::npos;
  };
  EXPECT_FALSE(saysMore(0.047));
  EXPECT_TRUE(saysMore(0.84));
}

FixBudget budgetOf(double sigma_m) { return {1.0, false, 0.9, 10.0, 400.0, sigma_m}; }

TEST(CommonBudget, IsHonestForIndependentSessions) {
  constexpr int kRuns = 1000;
  std::mt19937 random(6);
  for (const int sessions : {2, 3, 5}) {
    for (const double promised : {0.8, 1.0, 1.25}) {  // sigma, of the true one
      std::normal_distribution<double> normal(0.0, 0.4);
      int inside = 0;
      for (int run = 0; run < kRuns; ++run) {
        std::vector<TiedBudget> tied;
        Eigen::Vector2d off_m = Eigen::Vector2d::Zero();
        for (int k = 0; k < sessions; ++k) {
          tied.push_back({budgetOf(promised * 0.4), {normal(random), normal(random)}, 1e5 * k, 1e5 * k + 400.0});
          off_m += tied.back().offset_m / sessions;
        }
        for (TiedBudget& one : tied) one.offset_m -= off_m;
        const double sigma_m = commonBudget(tied).stretch * promised * 0.4 / std::sqrt(sessions);
        if (off_m.squaredNorm() < kInside95 * sigma_m * sigma_m) ++inside;
      }
      EXPECT_GE(inside, (promised < 1.0 ? 0.86 : 0.92) * kRuns) << sessions << ' ' << promised;
      EXPECT_LE(inside, 0.99 * kRuns) << sessions << ' ' << promised;
    }
  }
}

TEST(CommonBudget, CountsSessionsThatFollowEachOtherAsOne) {
  const FixBudget hidden{1.0, false, 0.3, 10.0, 400.0, 0.95};  // errs alike for longer than half an hour
  const auto at = [&](double begin_s) { return TiedBudget{hidden, Eigen::Vector2d::Zero(), begin_s, begin_s + 400.0}; };
  const CommonBudget common = commonBudget({at(900.0), at(0.0), at(1e5)});
  EXPECT_EQ(common.receivers[0], common.receivers[1]);
  EXPECT_NE(common.receivers[0], common.receivers[2]);
  EXPECT_LT(common.stretch, 1.0) << "two that agree";
  EXPECT_DOUBLE_EQ(commonBudget({at(900.0), at(0.0)}).stretch, 1.0) << "one";
}

std::vector<MapFix> fixesClaiming(double sigma_m) {
  std::vector<MapFix> fixes(10);
  for (MapFix& fix : fixes) fix.sigma_m = sigma_m;
  return fixes;
}

/// A receiver that says nothing may be off by metres for minutes, which shows nowhere.
TEST(FixBudget, OfAReceiverThatClaimsNothingIsThatOfUsualOnes) {
  const FixBudget shown{0.3, false, 0.2, 5.0, 100.0, 0.1};
  EXPECT_EQ(withoutClaims(shown, fixesClaiming(0.3), {}).sigma_m, 0.1) << "it claims something";
  const FixBudget unknown = withoutClaims(shown, fixesClaiming(0.0), {});
  EXPECT_TRUE(unknown.assumed);
  EXPECT_GE(unknown.sigma_m, 3.0);
  const FixBudget poor{0.3, false, 7.0, 5.0, 100.0, 2.0};
  EXPECT_EQ(withoutClaims(poor, fixesClaiming(0.0), {}).sigma_m, 7.0) << "what shows";
}

TEST(FixBudget, OfAReceiverThatSomebodyKnowsIsWhatHeSays) {
  GeometryConfig known;
  known.fix_sigma_m = 0.05;
  const FixBudget budget = withoutClaims({0.05, false, 0.04, 5.0, 100.0, 0.02}, fixesClaiming(0.0), known);
  EXPECT_TRUE(budget.assumed);
  EXPECT_EQ(budget.sigma_m, 0.02);
}

}  // namespace
}  // namespace visual_localization

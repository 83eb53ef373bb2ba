#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "geo/path_smoother.h"

namespace visual_localization {
namespace {

/// Along the x axis, a sample a second, by the speed in each.
std::vector<PathSample> atSpeeds(const std::vector<double>& speeds_mps) {
  std::vector<PathSample> samples{{0.0, {0.0, 0.0}}};
  for (const double speed_mps : speeds_mps) {
    samples.push_back({samples.back().time_s + 1.0, samples.back().position_m + Eigen::Vector2d(speed_mps, 0.0)});
  }
  return samples;
}

std::vector<double> repeated(std::size_t count, double value) { return std::vector<double>(count, value); }

std::vector<double> joined(std::vector<double> a, const std::vector<double>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST(MeasureSpeed, OfASteadyDriveIsItsSpeed) {
  const SpeedStatistics speed = measureSpeed(atSpeeds(repeated(50, 2.0)), 4.0);
  EXPECT_DOUBLE_EQ(speed.median_mps, 2.0);
  EXPECT_NEAR(speed.std_mps, 0.0, 1e-12);
}

TEST(MeasureSpeed, TheSpreadIsThatOfANormalDistribution) {
  std::vector<double> speeds_mps;
  for (int i = 0; i < 30; ++i) speeds_mps.insert(speeds_mps.end(), {1.8, 2.0, 2.2});
  const SpeedStatistics speed = measureSpeed(atSpeeds(speeds_mps), 1.0);
  EXPECT_NEAR(speed.median_mps, 2.0, 1e-9);
  EXPECT_NEAR(speed.std_mps, 1.4826 * 0.2, 1e-9) << "median deviation";
}

TEST(MeasureSpeed, StandingIsNoDriving) {
  const SpeedStatistics speed = measureSpeed(atSpeeds(joined(repeated(30, 0.0), repeated(30, 1.5))), 1.0);
  EXPECT_DOUBLE_EQ(speed.median_mps, 1.5);
  const SpeedStatistics crawl =
      measureSpeed(atSpeeds(joined(joined(repeated(30, 0.3), repeated(30, 0.9)), repeated(20, 2.0))), 1.0);
  EXPECT_NEAR(crawl.median_mps, 0.9, 1e-9) << "below a quarter of the fastest quarter's speed it stands";
}

TEST(MeasureSpeed, AParkedRobotMovesAtTheSpeedOfItsMotion) {
  const SpeedStatistics speed = measureSpeed(atSpeeds(joined(repeated(90, 0.01), repeated(10, 1.0))), 1.0);
  EXPECT_DOUBLE_EQ(speed.median_mps, 1.0);
  const SpeedStatistics slow = measureSpeed(atSpeeds(joined(repeated(90, 0.15), repeated(10, 0.3))), 1.0);
  EXPECT_NEAR(slow.median_mps, 0.15, 1e-9) << "0.3 m/s is not clearly faster than the noise";
}

TEST(MeasureSpeed, AFewSpikesAreNoMotion) {
  const SpeedStatistics speed = measureSpeed(atSpeeds(joined(repeated(199, 0.01), repeated(1, 30.0))), 1.0);
  EXPECT_LT(speed.median_mps, 0.02);
  const SpeedStatistics driven = measureSpeed(atSpeeds(joined(repeated(196, 0.01), repeated(5, 1.0))), 1.0);
  EXPECT_DOUBLE_EQ(driven.median_mps, 1.0) << "more than 2 %";
}

TEST(MeasureSpeed, AParkedRobotMovesWhereItIsClearlyFasterThanItsNoise) {
  const SpeedStatistics clear = measureSpeed(atSpeeds(joined(repeated(90, 0.1), repeated(10, 0.5))), 1.0);
  EXPECT_NEAR(clear.median_mps, 0.5, 1e-9) << "five times the noise";
  const SpeedStatistics drifting =
      measureSpeed(atSpeeds(joined(joined(repeated(80, 0.01), repeated(12, 0.1)), repeated(8, 1.0))), 1.0);
  EXPECT_NEAR(drifting.median_mps, 1.0, 1e-9) << "a drift of 0.1 m/s is no motion, however small the noise";
  const SpeedStatistics slow = measureSpeed(atSpeeds(joined(repeated(80, 0.3), repeated(20, 2.0))), 1.0);
  EXPECT_NEAR(slow.median_mps, 0.3, 1e-9) << "who drives at 0.3 m/s is not parked";
}

TEST(MeasureSpeed, TwoInAHundredAreMotion) {
  const SpeedStatistics speed = measureSpeed(atSpeeds(joined(repeated(98, 0.01), repeated(2, 1.0))), 1.0);
  EXPECT_NEAR(speed.median_mps, 1.0, 1e-9);
}

TEST(MeasureSpeed, TheMiddleOfTheMotionTellsWhatStandsStill) {
  const SpeedStatistics speed =
      measureSpeed(atSpeeds(joined(joined(repeated(90, 0.01), repeated(5, 0.25)), repeated(5, 2.0))), 1.0);
  EXPECT_NEAR(speed.median_mps, 2.0, 1e-9);
  EXPECT_NEAR(speed.std_mps, 0.0, 1e-9) << "0.25 m/s is less than a quarter of 2 m/s";
}

TEST(MeasureSpeed, AGapSaysNothing) {
  std::vector<PathSample> samples = atSpeeds(repeated(20, 2.0));
  samples.push_back({samples.back().time_s + 50.0, samples.back().position_m});
  EXPECT_NEAR(measureSpeed(samples, 1.0).std_mps, 0.0, 1e-12);
  for (const double gap_s : {2.9, 3.1}) {
    const std::vector<PathSample> pair{{0.0, {0.0, 0.0}}, {gap_s, {gap_s, 0.0}}};
    EXPECT_NEAR(measureSpeed(pair, 1.0).median_mps, gap_s < 3.0 ? 1.0 : 0.0, 1e-12) << "three spans are a gap";
  }
  EXPECT_DOUBLE_EQ(measureSpeed({samples[19], samples[21]}, 60.0).median_mps, 0.0) << "there is no such span";
  EXPECT_GT(measureSpeed({samples[19], samples[21]}, 50.0).median_mps, 0.0);
}

DrivingModel oneMetreASecond() {
  DrivingModel model;
  model.speed_mps = 1.0;
  model.speed_std_mps = 0.5;
  model.opening_cost = 10.0;
  model.rejection_cost = 2.0;
  model.max_bridge_s = 20.0;
  return model;
}

/// Whether a sample that lies aside of a steady drive is believed.
bool believesAside(double aside_m, const DrivingModel& model) {
  std::vector<PathSample> samples = atSpeeds(repeated(20, 1.0));
  samples[10].position_m.y() = aside_m;
  const std::vector<bool> consistent = consistentSamples(samples, model);
  EXPECT_EQ(std::count(consistent.begin(), consistent.end(), false), consistent[10] ? 0 : 1);
  return consistent[10];
}

// There and back at sqrt(1 + aside^2) m/s costs 2 ((v - 1) / 0.5)^2, to leave it out 10 + 2: equal at 2.22 m/s.
TEST(ConsistentSamples, ASampleIsLeftOutWhereThatCostsLess) {
  EXPECT_TRUE(believesAside(1.95, oneMetreASecond()));
  EXPECT_FALSE(believesAside(2.03, oneMetreASecond()));
  DrivingModel noisy = oneMetreASecond();
  noisy.step_noise_m = 0.5;  // with the spread of the speed hypot(0.5, 0.5): equal at 2.73 m/s
  EXPECT_TRUE(believesAside(2.50, noisy));
  EXPECT_FALSE(believesAside(2.58, noisy));
  DrivingModel dear = oneMetreASecond();
  dear.opening_cost = 30.0;  // equal at 3 m/s
  EXPECT_TRUE(believesAside(2.80, dear));
  EXPECT_FALSE(believesAside(2.86, dear));
}

TEST(ConsistentSamples, ARobotMayStandAndCrawl) {
  const auto all = [](const std::vector<bool>& consistent) {
    return std::all_of(consistent.begin(), consistent.end(), [](bool value) { return value; });
  };
  EXPECT_TRUE(all(consistentSamples(atSpeeds(joined(repeated(10, 1.0), repeated(10, 0.0))), oneMetreASecond())));
  EXPECT_TRUE(all(consistentSamples(atSpeeds(joined(repeated(10, 1.0), repeated(3, 0.3))), oneMetreASecond())));
}

TEST(ConsistentSamples, ToStandCostsHalfASigma) {
  DrivingModel model = oneMetreASecond();
  model.opening_cost = 0.0;
  model.rejection_cost = 0.6;
  const std::vector<PathSample> stops_at_last = atSpeeds(joined(repeated(10, 1.0), {0.1}));
  EXPECT_TRUE(consistentSamples(stops_at_last, model).back());
  model.rejection_cost = 0.4;
  EXPECT_FALSE(consistentSamples(stops_at_last, model).back());
  model.rejection_cost = 0.5;
  EXPECT_FALSE(consistentSamples(stops_at_last, model).back()) << "for the same cost the shorter path";
}

TEST(ConsistentSamples, AStretchThatIsDrivenTooFastLosesAsAWhole) {
  std::vector<PathSample> samples = atSpeeds(repeated(30, 1.0));
  for (std::size_t i = 10; i < 15; ++i) samples[i].position_m.y() = 6.0;
  const std::vector<bool> consistent = consistentSamples(samples, oneMetreASecond());
  for (std::size_t i = 0; i < samples.size(); ++i) EXPECT_EQ(consistent[i], i < 10 || i >= 15) << i;
}

TEST(ConsistentSamples, TheEndsMayBeWrong) {
  std::vector<PathSample> samples = atSpeeds(repeated(20, 1.0));
  samples[0].position_m.y() = 30.0;
  samples[1].position_m.y() = 30.0;
  samples[20].position_m.y() = -30.0;
  const std::vector<bool> consistent = consistentSamples(samples, oneMetreASecond());
  for (std::size_t i = 0; i < samples.size(); ++i) EXPECT_EQ(consistent[i], i >= 2 && i < 20) << i;
}

TEST(ConsistentSamples, OverALongGapNothingIsJoined) {
  std::vector<PathSample> samples = atSpeeds(repeated(11, 1.0));
  for (int i = 0; i < 5; ++i) samples.push_back({40.0 + i, {40.0 + i, 0.0}});
  DrivingModel model = oneMetreASecond();
  model.max_bridge_s = 29.0;  // from 11 s to 40 s
  std::vector<bool> consistent = consistentSamples(samples, model);
  EXPECT_EQ(std::count(consistent.begin(), consistent.end(), true), 17) << "exactly that long";
  model.max_bridge_s = 28.9;
  consistent = consistentSamples(samples, model);
  for (std::size_t i = 0; i < samples.size(); ++i) EXPECT_EQ(consistent[i], i < 12) << i << ": the longer part wins";
}

TEST(ConsistentSamples, OfNoneOrOne) {
  EXPECT_TRUE(consistentSamples({}, oneMetreASecond()).empty());
  EXPECT_EQ(consistentSamples({{0.0, {0.0, 0.0}}}, oneMetreASecond()), std::vector<bool>{true});
}

}  // namespace
}  // namespace visual_localization

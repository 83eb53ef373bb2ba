#include "geometry/ransac.h"

#include <array>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

namespace visual_localization {
namespace {

// 10 samples of two of five, each of them as often as the others: 1000 +- 30 times, of which six sigmas are 180.
TEST(Ransac, DrawsEachSampleAsOften) {
  std::minstd_rand random;
  std::map<std::set<std::size_t>, int> times;
  for (int i = 0; i < 10000; ++i) {
    const auto [first, second] = drawDistinct<2>(5, random);
    ++times[{first, second}];
  }
  EXPECT_EQ(times.size(), 10U) << "of two different ones below five";
  for (const auto& [sample, count] : times) {
    EXPECT_EQ(sample.size(), 2U);
    EXPECT_LT(*sample.rbegin(), 5U);
    EXPECT_NEAR(count, 1000, 180);
  }
}

TEST(Ransac, DrawsAllOfAsManyAsItNeeds) {
  std::minstd_rand random;
  for (int i = 0; i < 100; ++i) {
    const auto drawn = drawDistinct<3>(3, random);
    EXPECT_EQ(std::set<std::size_t>(drawn.begin(), drawn.end()), (std::set<std::size_t>{0, 1, 2}));
  }
}

// Hartley and Zisserman 2004, table 4.3, is for 99 %; for 99.9 % it is half as many again: log 0.001 / log(1 - w^s).
TEST(Ransac, TakesAsManySamplesAsTheOutliersAsk) {
  EXPECT_EQ(samplesNeeded(0.5, 3, 1, 1000), 52);
  EXPECT_EQ(samplesNeeded(0.7, 5, 1, 1000), 38);
  EXPECT_EQ(samplesNeeded(0.5, 5, 1, 1000), 218);
}

TEST(Ransac, StaysWithinItsLimits) {
  EXPECT_EQ(samplesNeeded(1.0, 5, 10, 1000), 10);
  EXPECT_EQ(samplesNeeded(0.99, 3, 30, 200), 30);
  EXPECT_EQ(samplesNeeded(0.1, 5, 10, 1000), 1000);
  EXPECT_EQ(samplesNeeded(0.0, 5, 10, 1000), 1000);
}

/// Lines through two of some points in a plane: y = slope x + offset.
class LineEstimator {
 public:
  using Model = Eigen::Vector2d;  // slope, offset
  static constexpr std::size_t kSampleSize = 2;
  static constexpr int kLeastSamples = 1;
  static constexpr int kMostSamples = 500;

  explicit LineEstimator(std::vector<Eigen::Vector2d> points, bool improves = false)
      : points_(std::move(points)), improves_(improves) {}

  std::size_t count() const { return points_.size(); }
  std::vector<Model> modelsOf(const std::array<std::size_t, 2>& sample, std::minstd_rand&) const {
    ++samples_;
    const Eigen::Vector2d way = points_[sample[1]] - points_[sample[0]];
    if (way.x() == 0.0) return {};
    const double slope = way.y() / way.x();
    return {{slope, points_[sample[0]].y() - slope * points_[sample[0]].x()}};
  }
  Support supportOf(const Model& line) const {
    Support support;
    for (const Eigen::Vector2d& point : points_) {
      const double error = std::abs(line[0] * point.x() + line[1] - point.y());
      if (error > 0.1) continue;
      ++support.inliers;
      support.score += 1.0 - error;
    }
    return support;
  }
  /// Towards the truth, from whatever line.
  template <class Keep>
  void improve(const Model& best, std::minstd_rand&, const Keep& keep) const {
    for (int i = 0; improves_ && i < 20; ++i) {
      if (!keep(Model(0.5 * (best + kTruth)))) return;
    }
  }
  int samples() const { return samples_; }

  inline static const Model kTruth{0.5, 2.0};

 private:
  std::vector<Eigen::Vector2d> points_;
  bool improves_;
  mutable int samples_ = 0;
};

/// `outliers` of 40 points lie anywhere, the others within `noise` of the line.
std::vector<Eigen::Vector2d> pointsOnLine(int outliers, double noise) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < 40; ++i) {
    const double x = 10.0 * any(random);
    const double y = LineEstimator::kTruth[0] * x + LineEstimator::kTruth[1] + noise * any(random);
    points.emplace_back(x, i < outliers ? 10.0 * any(random) : y);
  }
  return points;
}

TEST(Ransac, FindsTheModelAmongOutliers) {
  const LineEstimator estimator(pointsOnLine(20, 0.0));
  const auto line = mostSupported(estimator);
  ASSERT_TRUE(line);
  EXPECT_LT((*line - LineEstimator::kTruth).norm(), 1e-9);
  EXPECT_EQ(*line, *mostSupported(estimator)) << "the same for the same matches";
}

TEST(Ransac, StopsWhenTheShareOfInliersAllowsIt) {
  const LineEstimator clean(pointsOnLine(0, 0.0));
  ASSERT_TRUE(mostSupported(clean));
  EXPECT_EQ(clean.samples(), 1);
  const LineEstimator half(pointsOnLine(20, 0.0));
  ASSERT_TRUE(mostSupported(half));
  EXPECT_LE(half.samples(), samplesNeeded(0.5, 2, 1, 500)) << "some outliers lie on the line by chance";
  EXPECT_GT(half.samples(), 1);
}

TEST(Ransac, ImprovesEachBestModelFromWhereItIs) {
  const auto points = pointsOnLine(20, 0.05);
  const LineEstimator plain(points);
  const LineEstimator improving(points, true);
  EXPECT_LT((*mostSupported(improving) - LineEstimator::kTruth).norm(),
            (*mostSupported(plain) - LineEstimator::kTruth).norm());
}

TEST(Ransac, FindsNothingWhereNoSampleAllowsAModel) {
  EXPECT_FALSE(mostSupported(LineEstimator(std::vector<Eigen::Vector2d>(5, Eigen::Vector2d(1.0, 2.0)))));
}

}  // namespace
}  // namespace visual_localization

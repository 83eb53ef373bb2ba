#include <limits>
#include <numeric>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "test/support/example_map.h"
#include "test/support/synthetic.h"
#include "visual_localization/localization/particles.h"
#include "visual_localization/localization/scores.h"

namespace visual_localization {
namespace {

constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

/// A sweep over a street with scores that are made up; remembers which training images were compared.
class MadeUpSweep {
 public:
  explicit MadeUpSweep(std::size_t training_images, std::size_t max_images = 100, std::size_t max_kept = kAll)
      : map_(test::mapAt(test::street(training_images, 1.0))),
        scores_(training_images),
        sweep_(*map_, max_images, max_kept) {}

  template <class Weigh>
  void startImage(Weigh weigh) {
    compared.clear();
    scores_.startImage(FeatureKind::kLocal, [this, weigh](FeatureKind kind, std::size_t i) {
      EXPECT_EQ(kind, FeatureKind::kGlobal);
      EXPECT_EQ(compared.count(i), 0U) << "each at most once";
      compared.insert(i);
      return Score{weigh(i), weigh(i)};
    });
    sweep_.startImage();
  }
  std::size_t draw(Random& random) { return sweep_.draw(scores_, random); }
  std::vector<int> drawMany(int draws, std::uint32_t seed) {
    Random random(seed);
    std::vector<int> counts(map_->size(), 0);
    for (int i = 0; i < draws; ++i) ++counts.at(draw(random));
    return counts;
  }
  /// The training images that `images` images compare.
  std::set<std::size_t> comparedBy(int images) {
    std::set<std::size_t> all;
    Random random(1);
    for (int image = 0; image < images; ++image) {
      startImage([](std::size_t) { return 1.0; });
      draw(random);
      all.insert(compared.begin(), compared.end());
    }
    return all;
  }
  std::vector<std::size_t> mostSimilar(std::size_t count) { return sweep_.mostSimilar(scores_, count); }
  const Scores& scores() const { return scores_; }

  std::set<std::size_t> compared;  ///< for the current image

 private:
  std::shared_ptr<const TrainingMap> map_;
  Scores scores_;
  MapSweep sweep_;
};

/// Pearson's statistic; with `counts.size() - 1` degrees of freedom when the counts follow the weights.
double chiSquared(const std::vector<int>& counts, const std::vector<double>& weights) {
  const double draws = std::accumulate(counts.begin(), counts.end(), 0.0);
  const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
  double sum = 0.0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double expected = draws * weights[i] / total;
    sum += (counts[i] - expected) * (counts[i] - expected) / expected;
  }
  return sum;
}

TEST(MapSweep, DrawsInProportionToTheWeights) {
  const std::vector<double> weights{0.05, 0.2, 0.1, 0.4, 0.25, 0.01};
  MadeUpSweep sweep(weights.size());
  sweep.startImage([&](std::size_t i) { return weights[i]; });
  EXPECT_LT(chiSquared(sweep.drawMany(20000, 1), weights), 20.5);  // 99.9 % of 5 degrees
}

TEST(MapSweep, NeverDrawsWhatHasNoWeight) {
  MadeUpSweep sweep(6);
  sweep.startImage([](std::size_t i) { return i % 2 == 1 ? 1e-30 : 0.0; });
  const std::vector<int> counts = sweep.drawMany(3000, 2);
  for (const std::size_t i : {0U, 2U, 4U}) EXPECT_EQ(counts[i], 0);
  for (const std::size_t i : {1U, 3U, 5U}) EXPECT_GT(counts[i], 800);
}

TEST(MapSweep, DrawsAnyWhenNothingHasWeight) {
  MadeUpSweep sweep(8);
  sweep.startImage([](std::size_t) { return 0.0; });
  EXPECT_LT(chiSquared(sweep.drawMany(20000, 3), std::vector<double>(8, 1.0)), 24.3);  // 99.9 % of 7 degrees
}

TEST(MapSweep, ComparesOnceAnImageAndOnlyWhenAsked) {
  MadeUpSweep sweep(10);
  const auto weigh = [](std::size_t i) { return static_cast<double>(i); };
  sweep.startImage(weigh);
  EXPECT_EQ(sweep.scores().swept(), 0U);
  sweep.drawMany(50, 4);
  EXPECT_EQ(sweep.compared.size(), 10U);
  EXPECT_EQ(sweep.scores().swept(), 10U);
  EXPECT_EQ(sweep.scores().comparisons(), 0U) << "particles were compared with nothing";
  sweep.startImage(weigh);
  EXPECT_EQ(sweep.scores().swept(), 0U);
  sweep.startImage(weigh);
  sweep.drawMany(50, 5);
  EXPECT_EQ(sweep.compared.size(), 10U);
}

/// The kinds of features that mostSimilar() compares by.
std::set<FeatureKind> askedBy(const TrainingMap& map, bool by_vlad, FeatureKind particles) {
  std::set<FeatureKind> kinds;
  Scores scores(map.size());
  scores.startImage(particles, [&kinds](FeatureKind kind, std::size_t image) {
    kinds.insert(kind);
    const double similarity = kind == FeatureKind::kVlad && image == 7 ? 0.9 : 0.1;
    return Score{similarity, similarity};
  });
  MapSweep sweep(map, 100, kAll, by_vlad);
  sweep.startImage();
  const std::vector<std::size_t> most = sweep.mostSimilar(scores, 3);
  EXPECT_EQ(most.size(), 3U);
  EXPECT_EQ(scores.swept(), map.size());
  EXPECT_EQ(scores.comparisons(), 0U);
  EXPECT_EQ(kinds.count(FeatureKind::kVlad) > 0, most.front() == 7U);
  return kinds;
}

TEST(MapSweep, ProposesByVladWhereTheMapHasIt) {
  const TrainingMap described = test::describedMap();
  const TrainingMap plain(test::exampleHeader(), test::exampleImages(24));
  const std::set<FeatureKind> vlad{FeatureKind::kVlad};
  const std::set<FeatureKind> global{FeatureKind::kGlobal};
  EXPECT_EQ(askedBy(described, true, FeatureKind::kLocal), vlad);
  EXPECT_EQ(askedBy(described, false, FeatureKind::kLocal), global) << "nobody wants it";
  EXPECT_EQ(askedBy(plain, true, FeatureKind::kLocal), global) << "the map has none";
  EXPECT_EQ(askedBy(described, true, FeatureKind::kGlobal), global) << "it would need local features";
}

TEST(MapSweep, SeesAllOfAMapInMemoryWithTime) {
  MadeUpSweep sweep(1003, 10);
  EXPECT_EQ(sweep.comparedBy(101).size(), 1003U);
}

TEST(MapSweep, SeesNoMoreThanCanBeKept) {
  MadeUpSweep sweep(1000, 10, 45);
  const std::set<std::size_t> compared = sweep.comparedBy(300);
  EXPECT_EQ(compared.size(), 40U);
  EXPECT_LT(*compared.begin(), 26U) << "spread over the map";
  EXPECT_GE(*compared.rbegin(), 974U);
  MadeUpSweep nothing_kept(1000, 10, 0);
  EXPECT_EQ(nothing_kept.comparedBy(300).size(), 10U);
}

TEST(MapSweep, BeginsAtAsManyImagesAsCanBeKept) {
  EXPECT_EQ(MadeUpSweep(1000, 10, 40).comparedBy(300).size(), 40U) << "4 times 10";
  EXPECT_EQ(MadeUpSweep(1000, 10, 39).comparedBy(300).size(), 30U);
  EXPECT_EQ(MadeUpSweep(21, 11, 21).comparedBy(4).size(), 11U) << "every second of 21, and 22 are too many";
}

TEST(MapSweep, ANewImageForgetsTheOldWeights) {
  MadeUpSweep sweep(10);
  Random random(6);
  for (const std::size_t only : {7U, 2U, 9U}) {
    sweep.startImage([only](std::size_t i) { return i == only ? 0.3 : 0.0; });
    for (int i = 0; i < 20; ++i) EXPECT_EQ(sweep.draw(random), only);
  }
}

TEST(MapSweep, SeesAllOfALargeMapOverSuccessiveImages) {
  constexpr std::size_t kMax = 8;
  for (const std::size_t size : {9U, 16U, 17U, 25U, 64U, 100U}) {
    const std::size_t images = (size + kMax - 1) / kMax;
    MadeUpSweep sweep(size, kMax);
    Random random(7);
    for (int repetition = 0; repetition < 3; ++repetition) {
      std::multiset<std::size_t> compared;
      for (std::size_t image = 0; image < images; ++image) {
        sweep.startImage([](std::size_t) { return 1.0; });
        for (int i = 0; i < 30; ++i) {
          const std::size_t drawn = sweep.draw(random);
          EXPECT_EQ(sweep.compared.count(drawn), 1U);
        }
        EXPECT_LE(sweep.compared.size(), kMax);
        compared.insert(sweep.compared.begin(), sweep.compared.end());
      }
      ASSERT_EQ(compared.size(), size);
      for (std::size_t i = 0; i < size; ++i) EXPECT_EQ(compared.count(i), 1U) << i << " of " << size;
    }
  }
}

TEST(MapSweep, ThinnedOutItStillDrawsByWeight) {
  MadeUpSweep sweep(30, 10);
  Random random(8);
  std::set<std::size_t> best;
  for (int image = 0; image < 3; ++image) {
    sweep.startImage([](std::size_t i) { return i >= 27 ? 1.0 : 0.0; });
    const std::size_t drawn = sweep.draw(random);
    EXPECT_EQ(sweep.compared.count(drawn), 1U);
    best.insert(drawn);
  }
  EXPECT_EQ(best, (std::set<std::size_t>{27, 28, 29}));
}

TEST(MapSweep, TheMostSimilarOfOneImageAreOfAnotherPartThanThoseOfTheNext) {
  MadeUpSweep sweep(30, 10);
  std::set<std::size_t> best;
  for (int image = 0; image < 3; ++image) {
    sweep.startImage([](std::size_t i) { return i >= 27 ? 1.0 : 0.0; });
    best.insert(sweep.mostSimilar(1).front());
  }
  EXPECT_EQ(best, (std::set<std::size_t>{27, 28, 29}));
}

TEST(MapSweep, AMapOfOneImageLeavesNoChoice) {
  for (const double weight : {0.0, 0.7}) {
    MadeUpSweep sweep(1, 1);
    sweep.startImage([weight](std::size_t) { return weight; });
    Random random(9);
    for (int i = 0; i < 10; ++i) EXPECT_EQ(sweep.draw(random), 0U);
  }
}

TEST(MapSweep, WhatParticlesWereComparedWithIsNotComparedAgain) {
  const auto map = test::mapAt(test::street(50, 1.0));
  Scores scores(map->size());
  MapSweep sweep(*map, 1000, kAll);
  int computed = 0;
  scores.startImage(FeatureKind::kGlobal, [&computed](FeatureKind, std::size_t) {
    ++computed;
    return Score{0.5, 0.5};
  });
  for (const std::size_t i : {3U, 7U, 3U}) scores[i];
  sweep.ratio(scores, map->position_m(20), 5.0);
  Random random(1);
  sweep.draw(scores, random);
  scores[8];  // known from the sweep, but only now compared with a particle
  EXPECT_EQ(computed, 50);
  EXPECT_EQ(scores.comparisons(), 3U);
  EXPECT_EQ(scores.swept(), 47U);
}

/// Looks like two positions of the map, and a little like all others.
class TwoAlike {
 public:
  TwoAlike(const TrainingMap& map, std::size_t max_images) : scores_(map.size()), sweep_(map, max_images, kAll) {}

  void startImage(std::size_t first, double like_first, std::size_t second, double like_second) {
    asked.clear();
    scores_.startImage(FeatureKind::kLocal, [=](FeatureKind kind, std::size_t i) {
      EXPECT_EQ(kind, FeatureKind::kGlobal);
      asked.insert(i);
      const double similarity = i == first ? like_first : i == second ? like_second : 0.1;
      return Score{similarity, similarity};
    });
    sweep_.startImage();
  }
  double ratio(const Eigen::Vector2d& position_m) { return sweep_.ratio(scores_, position_m, 5.0); }

  std::set<std::size_t> asked;

 private:
  Scores scores_;
  MapSweep sweep_;
};

/// A loop of 200 images, one every 0.94 m.
class PlaceRatioTest : public ::testing::Test {
 protected:
  std::shared_ptr<const TrainingMap> map_ = test::mapAt(test::circle(200, 30.0));
  Eigen::Vector2d at(std::size_t image) const { return map_->image(image).position_m; }
};

TEST_F(PlaceRatioTest, TheBestHereOverTheBestAnywhere) {
  TwoAlike sweep(*map_, 1000);
  sweep.startImage(20, 0.6, 120, 0.8);
  EXPECT_DOUBLE_EQ(sweep.ratio(at(120)), 1.0);
  EXPECT_DOUBLE_EQ(sweep.ratio(at(20)), 0.75);
  EXPECT_DOUBLE_EQ(sweep.ratio(at(70)), 0.125);
  EXPECT_EQ(sweep.asked.size(), map_->size());
}

TEST_F(PlaceRatioTest, HereEndsAtTheGivenDistance) {
  TwoAlike sweep(*map_, 1000);
  sweep.startImage(20, 0.8, 120, 0.8);
  EXPECT_DOUBLE_EQ(sweep.ratio(at(25)), 1.0) << "4.7 m";
  EXPECT_DOUBLE_EQ(sweep.ratio(at(26)), 0.125) << "5.6 m";
}

TEST(PlaceRatio, AnImageHereIsNoRivalHoweverManyAreNearer) {
  // Eight sessions along one street, 0.6 m from image to image: 32 images lie within 1.5 m.
  std::vector<Eigen::Vector2d> positions_m;
  for (int session = 0; session < 8; ++session) {
    for (const Eigen::Vector2d& position_m : test::street(60, 0.6)) positions_m.push_back(position_m);
  }
  const auto map = test::mapAt(positions_m);
  TwoAlike sweep(*map, 1000);
  sweep.startImage(5 * 60 + 20, 0.8, 2 * 60 + 50, 0.4);
  EXPECT_DOUBLE_EQ(sweep.ratio({12.0 + 3.6, 0.0}), 1.0) << "the best lies 3.6 m behind";
  EXPECT_DOUBLE_EQ(sweep.ratio({30.0, 0.0}), 0.5);
}

TEST_F(PlaceRatioTest, NothingAlikeAnywhereIsNoReasonToDoubt) {
  Scores scores(map_->size());
  scores.startImage(FeatureKind::kLocal, [](FeatureKind, std::size_t) { return Score{}; });
  EXPECT_EQ(MapSweep(*map_, 1000, kAll).ratio(scores, at(0), 5.0), 1.0);
}

TEST_F(PlaceRatioTest, OfALargeMapAnotherPartIsAskedEachTime) {
  TwoAlike sweep(*map_, 50);
  std::set<std::size_t> all;
  for (int i = 0; i < 4; ++i) {
    sweep.startImage(20, 0.6, 120, 0.8);
    sweep.ratio(at(20));
    EXPECT_LE(sweep.asked.size(), 50U + 11U);
    all.insert(sweep.asked.begin(), sweep.asked.end());
  }
  EXPECT_EQ(all.size(), map_->size());
}

TEST(MapSweep, NamesTheMostSimilarOfAllTheMap) {
  MadeUpSweep sweep(50);
  sweep.startImage([](std::size_t i) { return i == 7 ? 0.9 : i == 31 ? 0.8 : 0.1; });
  EXPECT_EQ(sweep.mostSimilar(2), (std::vector<std::size_t>{7, 31}));
  EXPECT_EQ(sweep.mostSimilar(1000).size(), 50U);
  EXPECT_EQ(sweep.compared.size(), 50U);
}

}  // namespace
}  // namespace visual_localization

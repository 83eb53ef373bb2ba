#include "visual_localization/localization/place_check.h"

#include <set>

#include <gtest/gtest.h>

#include "test/support/synthetic.h"

namespace visual_localization {
namespace {

/// Looks like two places of the map, and a little like all others.
class TwoPlaces final : public ComparableImage {
 public:
  TwoPlaces(std::size_t first, double like_first, std::size_t second, double like_second)
      : first_(first), second_(second), like_first_(like_first), like_second_(like_second) {}

  Score compare(FeatureKind kind, std::size_t i) override {
    EXPECT_EQ(kind, FeatureKind::kGlobal);
    asked.insert(i);
    const double similarity = i == first_ ? like_first_ : i == second_ ? like_second_ : 0.1;
    return {similarity, similarity, 0, false};
  }
  std::size_t siftFeatures() override { return 100; }

  std::set<std::size_t> asked;

 private:
  std::size_t first_, second_;
  double like_first_, like_second_;
};

/// A round of 200 images, one every 0.94 m.
class PlaceCheckTest : public ::testing::Test {
 protected:
  std::shared_ptr<const TrainingMap> map_ = test::mapAt(test::circle(200, 30.0));
  Eigen::Vector2d at(std::size_t image) const { return map_->image(image).position_m; }
};

TEST_F(PlaceCheckTest, TheBestHereOverTheBestAnywhere) {
  PlaceCheck check(*map_, 1000, 5.0);
  TwoPlaces image(20, 0.6, 120, 0.8);
  EXPECT_DOUBLE_EQ(check.ratio(image, at(120)), 1.0);
  EXPECT_DOUBLE_EQ(check.ratio(image, at(20)), 0.75);
  EXPECT_DOUBLE_EQ(check.ratio(image, at(70)), 0.125);
  EXPECT_EQ(image.asked.size(), map_->size());
}

TEST_F(PlaceCheckTest, HereEndsAtTheGivenDistance) {
  PlaceCheck check(*map_, 1000, 5.0);
  TwoPlaces image(20, 0.8, 120, 0.8);
  EXPECT_DOUBLE_EQ(check.ratio(image, at(25)), 1.0) << "4.7 m";
  EXPECT_DOUBLE_EQ(check.ratio(image, at(26)), 0.125) << "5.6 m";
}

TEST(PlaceCheck, AnImageHereIsNoRivalHoweverManyAreNearer) {
  // Eight sessions along one street, 0.6 m from image to image: 32 images lie within 1.5 m.
  std::vector<Eigen::Vector2d> positions_m;
  for (int session = 0; session < 8; ++session) {
    for (const Eigen::Vector2d& place_m : test::street(60, 0.6)) positions_m.push_back(place_m);
  }
  const auto map = test::mapAt(positions_m);
  PlaceCheck check(*map, 1000, 5.0);
  TwoPlaces image(5 * 60 + 20, 0.8, 2 * 60 + 50, 0.4);
  EXPECT_DOUBLE_EQ(check.ratio(image, {12.0 + 3.6, 0.0}), 1.0) << "the best lies 3.6 m behind";
  EXPECT_DOUBLE_EQ(check.ratio(image, {30.0, 0.0}), 0.5);
}

TEST_F(PlaceCheckTest, NothingAlikeAnywhereIsNoReasonToDoubt) {
  PlaceCheck check(*map_, 1000, 5.0);
  class Blank final : public ComparableImage {
    Score compare(FeatureKind, std::size_t) override { return {}; }
    std::size_t siftFeatures() override { return 0; }
  } blank;
  EXPECT_EQ(check.ratio(blank, at(0)), 1.0);
}

TEST_F(PlaceCheckTest, OfALargeMapAnotherPartIsAskedEachTime) {
  PlaceCheck check(*map_, 50, 5.0);
  std::set<std::size_t> all;
  for (int i = 0; i < 4; ++i) {
    TwoPlaces image(20, 0.6, 120, 0.8);
    check.ratio(image, at(20));
    EXPECT_LE(image.asked.size(), 50U + 11U);
    all.insert(image.asked.begin(), image.asked.end());
  }
  EXPECT_EQ(all.size(), map_->size());
}

}  // namespace
}  // namespace visual_localization

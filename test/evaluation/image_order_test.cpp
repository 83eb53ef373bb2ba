#include <algorithm>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "evaluation/run.h"

namespace visual_localization {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::Lt;

constexpr bool kClosed = true;
constexpr bool kOpen = false;

TEST(ImageOrder, WrapsAroundTheClosedRound) {
  EXPECT_THAT(imageOrder(5, 0, std::nullopt), ElementsAre(0, 1, 2, 3, 4));
  EXPECT_THAT(imageOrder(5, 3, std::nullopt), ElementsAre(3, 4, 0, 1, 2));
}

TEST(ImageOrder, KidnappingJumpsAndGoesOnFromThere) {
  EXPECT_THAT(imageOrder(6, 0, Kidnapping{3, 0}), ElementsAre(0, 1, 2, 0, 1, 2));
  EXPECT_THAT(imageOrder(6, 4, Kidnapping{2, 5}), ElementsAre(4, 5, 5, 0, 1, 2));
}

TEST(ImageOrder, RefusesIndicesBeyondTheRound) {
  EXPECT_THROW(imageOrder(5, 5, std::nullopt), std::invalid_argument);
  EXPECT_THROW(imageOrder(5, 0, Kidnapping{5, 0}), std::invalid_argument);
  EXPECT_THROW(imageOrder(5, 0, Kidnapping{0, 9}), std::invalid_argument);
  EXPECT_THROW(imageOrder(5, 5, RunShape{}), std::invalid_argument);
  EXPECT_TRUE(imageOrder(0, 0, std::nullopt).empty());
  EXPECT_TRUE(imageOrder(0, 0, RunShape{}).empty());
}

TEST(ImageOrder, ARunHasItsLength) {
  EXPECT_THAT(imageOrder(8, 2, RunShape{kOpen, 1.0, false, 3}), ElementsAre(2, 3, 4));
  EXPECT_THAT(imageOrder(8, 6, RunShape{kOpen, 1.0, false, 3}), ElementsAre(6, 7));
  EXPECT_THAT(imageOrder(8, 6, RunShape{kClosed, 1.0, false, 3}), ElementsAre(6, 7, 0));
  EXPECT_THAT(imageOrder(8, 0, RunShape{kOpen, 2.0, false, 5}), ElementsAre(0, 2, 4));
}

TEST(StartImages, EverySoMany) {
  EXPECT_THAT(startImagesEvery(25, kClosed, 10, 0), ElementsAre(0, 10, 20));
  EXPECT_THAT(startImagesEvery(25, kOpen, 10, 0), ElementsAre(0, 10));
  EXPECT_THAT(startImagesEvery(101, kOpen, 10, 60), ElementsAre(0, 10, 20, 30, 40, 50));
  EXPECT_THAT(startImagesEvery(100, kOpen, 10, 20), ElementsAre(0, 10, 20, 30, 40, 50, 60, 70, 80));
  EXPECT_THAT(startImagesEvery(50, kOpen, 10, 60), ElementsAre(0, 10, 20));
  EXPECT_THAT(startImagesEvery(1, kOpen, 10, 1), ElementsAre(0));
}

TEST(ImageOrder, OnAnOpenRoundTheRobotIsCarriedBack) {
  RunShape shape{kOpen};
  shape.kidnapped = true;
  EXPECT_THAT(imageOrder(8, 0, shape), ElementsAre(0, 1, 2, 3, 0, 1, 2, 3));
  EXPECT_THAT(imageOrder(7, 0, shape), ElementsAre(0, 1, 2, 0, 1, 2, 3));
  EXPECT_THAT(imageOrder(8, 3, shape), ElementsAre(3, 4, 1, 2, 3));
  EXPECT_THAT(imageOrder(1, 0, shape), ElementsAre(0));
  EXPECT_THAT(imageOrder(6, 2, RunShape{kOpen, 64.0, true}), ElementsAre(2));
  shape.speed = 3.0;
  EXPECT_THAT(imageOrder(10, 0, shape), ElementsAre(0, 3, 1, 4));
  for (std::size_t images = 1; images < 40; ++images) {
    for (const double speed : {0.5, 1.0, 2.0, 5.0}) {
      shape.speed = speed;
      for (const std::size_t start : startImages(images, kOpen, 0)) {
        const std::vector<std::size_t> order = imageOrder(images, start, shape);
        std::size_t jumps = 0;
        for (std::size_t i = 1; i < order.size(); ++i) jumps += order[i] < order[i - 1] ? 1 : 0;
        EXPECT_EQ(order.front(), start);
        EXPECT_LE(jumps, 1U) << images << " images from " << start << ": it is carried once";
        if (speed != 1.0) continue;
        std::size_t carried = 0;
        for (std::size_t i = 1; i < order.size(); ++i) carried += order[i] != order[i - 1] + 1 ? 1 : 0;
        EXPECT_EQ(carried, order.size() > 1 ? 1U : 0U) << images << " images from " << start;
      }
    }
  }
}

TEST(ImageOrder, AnOpenRoundIsDrivenToItsEnd) {
  EXPECT_THAT(imageOrder(5, 2, RunShape{kOpen}), ElementsAre(2, 3, 4));
  EXPECT_THAT(imageOrder(5, 4, RunShape{kOpen}), ElementsAre(4));
  EXPECT_THAT(imageOrder(5, 2, RunShape{kClosed}), ElementsAre(2, 3, 4, 0, 1));
}

TEST(ImageOrder, SpeedSkipsImagesOrRepeatsThem) {
  EXPECT_THAT(imageOrder(5, 0, RunShape{kOpen, 2.0}), ElementsAre(0, 2, 4));
  EXPECT_THAT(imageOrder(5, 3, RunShape{kClosed, 2.0}), ElementsAre(3, 0, 2));
  EXPECT_THAT(imageOrder(2, 0, RunShape{kOpen, 0.5}), ElementsAre(0, 0, 1, 1));
  EXPECT_THAT(imageOrder(3, 1, RunShape{kOpen, 64.0}), ElementsAre(1));
  EXPECT_EQ(imageOrder(10, 0, RunShape{kOpen, 1.0 / 64.0}).size(), 640U);
}

TEST(ImageOrder, NoSpeedDrivesBeyondTheEndOfAnOpenRound) {
  EXPECT_EQ(imageOrder(21, 0, RunShape{kOpen, 0.7}).size(), 30U);
  for (std::size_t images = 1; images < 60; ++images) {
    for (int speed = 5; speed < 400; ++speed) {
      const auto order = imageOrder(images, 0, RunShape{kOpen, 0.01 * speed});
      ASSERT_TRUE(std::is_sorted(order.begin(), order.end())) << images << " images, speed " << 0.01 * speed;
      ASSERT_EQ(order.front(), 0U);
    }
  }
}

TEST(ImageOrder, TheKidnappedGoOnAtTheOtherSide) {
  EXPECT_THAT(imageOrder(6, 1, RunShape{kClosed, 1.0, true}), ElementsAre(1, 2, 3, 1, 2, 3));
  EXPECT_THAT(imageOrder(1, 0, RunShape{kClosed, 1.0, true}), ElementsAre(0));
}

TEST(StartImages, AreSpreadEvenlyOverAClosedRound) {
  EXPECT_THAT(startImages(6, kClosed, 0), ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_THAT(startImages(6, kClosed, 3), ElementsAre(0, 2, 4));
  EXPECT_THAT(startImages(7, kClosed, 3), ElementsAre(0, 2, 4));
  EXPECT_THAT(startImages(3, kClosed, 1000000), ElementsAre(0, 1, 2));
}

TEST(StartImages, LieInTheFirstHalfOfAnOpenRound) {
  EXPECT_THAT(startImages(7, kOpen, 0), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(startImages(8, kOpen, 2), ElementsAre(0, 2));
  EXPECT_THAT(startImages(1, kOpen, 5), ElementsAre(0));
  EXPECT_THAT(startImages(403, kOpen, 8), Each(Lt(202U)));
}

}  // namespace
}  // namespace visual_localization

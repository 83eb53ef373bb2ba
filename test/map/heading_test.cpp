#include <cmath>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "test/support/synthetic.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {
namespace {

/// A street of 10 m that was driven eastwards, with an image every metre, and back half a metre beside.
std::shared_ptr<const TrainingMap> bothWays() {
  std::vector<TrainingImage> images(20);
  for (std::size_t i = 0; i < images.size(); ++i) {
    const bool back = i >= 10;
    images[i].session = back ? 1 : 0;
    images[i].position_m = {static_cast<double>(back ? 19 - i : i), back ? 0.5 : 0.0};
    images[i].yaw_rad = back ? kPi : 0.0;
  }
  MapHeader header;
  header.datum = {48.5, 9.0, 400.0};
  header.image_size = {320, 240};
  header.sessions = {{"there"}, {"back"}};
  return std::make_shared<const TrainingMap>(header, std::move(images));
}

/// At image 4 of the way there, on the side of the way back.
const Eigen::Vector2d kBesideImage4_m(4.2, 0.4);

TEST(Heading, IsThatOfTheWayThatWasRecognised) {
  const auto map = bothWays();
  std::vector<Neighbour> neighbours;
  ASSERT_EQ(map->nearest(kBesideImage4_m).image, 15U) << "the nearest image is of the way back";
  const Heading heading = headingAt(*map, kBesideImage4_m, 4, neighbours);
  EXPECT_DOUBLE_EQ(heading.yaw_rad, 0.0);
  EXPECT_DOUBLE_EQ(heading.variance_rad2, 0.0);
}

TEST(Heading, IsUncertainWhenAllAroundFaceTheOtherWay) {
  // The best match is the only image of its way, and farther off than the five that face west.
  const auto map = test::mapAt({{9, 0}, {8, 0}, {7, 0}, {6, 0}, {5, 0}, {4, 0}, {4, -3}, {20, -3}});
  ASSERT_NEAR(std::abs(map->yaw_rad(2)), kPi, 1e-9);
  ASSERT_NEAR(map->yaw_rad(6), 0.0, 1e-9);
  std::vector<Neighbour> neighbours;
  const Heading heading = headingAt(*map, {7.0, 0.0}, 6, neighbours);
  EXPECT_DOUBLE_EQ(heading.yaw_rad, map->yaw_rad(6));
  EXPECT_GT(heading.variance_rad2, 4.0);
}

TEST(Heading, IsUncertainWhenNothingTellsTheWay) {
  const auto map = bothWays();
  std::vector<Neighbour> neighbours;
  const Heading heading = headingAt(*map, kBesideImage4_m, {}, neighbours);
  EXPECT_DOUBLE_EQ(heading.yaw_rad, kPi);
  EXPECT_GT(heading.variance_rad2, 2.0);
}

TEST(Heading, OfACornerIsThatOfTheNearestImage) {
  // Five images eastwards and five northwards: nothing is left out of the variance.
  const auto map = test::mapAt({{0, 0}, {1, 0}, {2, 0}, {3, 0}, {4, 0}, {4, 1}, {4, 2}, {4, 3}});
  std::vector<Neighbour> neighbours;
  const Heading heading = headingAt(*map, {4.0, 1.0}, 2, neighbours);
  EXPECT_NEAR(heading.yaw_rad, kPi / 2.0, 1e-9);
  EXPECT_GT(heading.variance_rad2, 0.4);
}

}  // namespace
}  // namespace visual_localization

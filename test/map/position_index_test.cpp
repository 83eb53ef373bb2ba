#include "map/position_index.h"

#include <algorithm>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "base/time.h"
#include "test/support/synthetic.h"

namespace visual_localization {
namespace {

using Positions = std::vector<Eigen::Vector2d>;

/// The first of the nearest, found by looking at all.
std::uint32_t nearestOf(const Positions& positions_m, const Eigen::Vector2d& place_m) {
  const auto nearer = [&place_m](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return (a - place_m).squaredNorm() < (b - place_m).squaredNorm();
  };
  const auto first = std::min_element(positions_m.begin(), positions_m.end(), nearer);
  return static_cast<std::uint32_t>(first - positions_m.begin());
}

/// At random places in the square around the origin the answer is that of looking at all positions.
void expectNearest(const Positions& positions_m, double half_side_m) {
  const PositionIndex index(positions_m);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> coordinate_m(-half_side_m, half_side_m);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector2d place_m(coordinate_m(random), coordinate_m(random));
    const Neighbour found = index.nearest(place_m);
    const std::uint32_t expected = nearestOf(positions_m, place_m);
    EXPECT_EQ(found.image, expected) << place_m.transpose();
    EXPECT_DOUBLE_EQ(found.distance_m, (positions_m[expected] - place_m).norm());
  }
}

TEST(PositionIndex, AnswersAsLookingAtAllPositionsWould) {
  expectNearest(test::circle(150, 30.0), 32.0);
  std::mt19937 random(3);
  std::normal_distribution<double> coordinate_m(0.0, 10.0);
  Positions cloud(200);
  for (auto& position : cloud) position = {coordinate_m(random), coordinate_m(random)};
  expectNearest(cloud, 20.0);
  Positions line = test::street(100, 1.0);
  expectNearest(line, 5.0);
  for (auto& position : line) std::swap(position.x(), position.y());
  expectNearest(line, 5.0);
  expectNearest({{-1e6, -1e6}, {1e6, 1e6}, {1e6, -1e6}}, 1e6);
}

TEST(PositionIndex, GivesTheFirstOfEquals) {
  const PositionIndex index({{0.0, 0.0}, {2.0, 0.0}, {2.0, 0.0}, {0.0, 0.0}, {4.0, 0.0}});
  EXPECT_EQ(index.nearest({0.1, 0.1}).image, 0U);
  EXPECT_EQ(index.nearest({1.0, 0.0}).image, 0U);
  EXPECT_EQ(index.nearest({1.5, 0.0}).image, 1U);
  EXPECT_EQ(index.nearest({3.0, 0.25}).image, 1U);
}

/// A street of 100 m in whose middle the robot was parked: `parked` images within `reach_m`.
Positions parkedOnStreet(std::size_t parked, double reach_m) {
  Positions positions_m = test::street(100, 1.0);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> offset_m(-reach_m, reach_m);
  for (std::size_t i = 0; i < parked; ++i) positions_m.emplace_back(50.0 + offset_m(random), offset_m(random));
  return positions_m;
}

TEST(PositionIndex, ManyImagesOnOneSpotTakeNoLongerThanOthers) {
  for (const double reach_m : {0.0, 1e-9, 0.01}) {
    const Positions positions_m = parkedOnStreet(19000, reach_m);
    const CpuStopwatch watch;
    const PositionIndex index(positions_m);
    EXPECT_LT(watch.elapsed_ms(), 10000.0) << "the tree alone takes milliseconds";
    for (const Eigen::Vector2d& place_m : Positions{{50.0, 0.0}, {50.4, 3.0}, {10.2, 0.3}, {50.001, 0.002}}) {
      EXPECT_EQ(index.nearest(place_m).image, nearestOf(positions_m, place_m)) << place_m.transpose();
    }
  }
}

TEST(PositionIndex, OfMoreImagesOnOneSpotThanAreSoughtTheFirstAreFound) {
  const Positions positions_m = parkedOnStreet(200'000, 0.0);
  const PositionIndex index(positions_m);
  constexpr std::size_t kFirstParked = 100;
  const CpuStopwatch watch;
  std::vector<Neighbour> found;
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector2d place_m(50.0, 0.3 + 1e-4 * i);
    EXPECT_EQ(index.nearest(place_m).image,
              nearestOf(Positions(positions_m.begin(), positions_m.begin() + 200), place_m));
    index.nearest(place_m, 32, found);
    ASSERT_EQ(found.size(), 32U);
    EXPECT_EQ(found.back().image, kFirstParked + 30) << "one of the street is on the same spot";
  }
  EXPECT_LT(watch.elapsed_ms(), 1000.0) << "to look at all of them each time takes seconds";
}

TEST(PositionIndex, WithinARadiusAreAllAndInOrder) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> anywhere(-10.0, 10.0);
  Positions positions_m(3000, Eigen::Vector2d(1.0, 2.0));  // more on one spot than are sought there
  while (positions_m.size() < 5000) positions_m.emplace_back(anywhere(random), anywhere(random));
  std::shuffle(positions_m.begin(), positions_m.end(), random);
  const PositionIndex index(positions_m);
  std::vector<std::uint32_t> found;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector2d place_m(anywhere(random), anywhere(random));
    const double radius_m = i % 10 == 0 ? (positions_m[0] - place_m).norm() : std::abs(anywhere(random));
    std::vector<std::uint32_t> expected;
    for (std::uint32_t k = 0; k < positions_m.size(); ++k) {
      if ((positions_m[k] - place_m).norm() <= radius_m) expected.push_back(k);
    }
    index.within(place_m, radius_m, found);
    ASSERT_EQ(found, expected) << place_m.transpose() << " within " << radius_m;
  }
  index.within({1.0, 2.0}, 0.0, found);
  EXPECT_EQ(found.size(), 3000U);
  index.within({std::numeric_limits<double>::quiet_NaN(), 0.0}, 1.0, found);
  EXPECT_TRUE(found.empty());
}

}  // namespace
}  // namespace visual_localization

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "survey/map_survey.h"

namespace visual_localization {
namespace {

struct Sight {
  Eigen::Vector2d position_m;
  double yaw_rad;
  int session;
};

double cell(double coordinate_m) { return std::floor(coordinate_m / SightGrid::kCell_m); }

bool isHere(const Sight& a, const Sight& b) {
  return std::abs(cell(a.position_m.x()) - cell(b.position_m.x())) <= 1.0 &&
         std::abs(cell(a.position_m.y()) - cell(b.position_m.y())) <= 1.0;
}

int octantsBetween(const Sight& a, const Sight& b) {
  const int turn = std::abs(octantOf(a.yaw_rad) - octantOf(b.yaw_rad));
  return std::min(turn, kOctants - turn);
}

/// Sights within some cells of `centre_m`.
std::vector<Sight> sightsAround(const Eigen::Vector2d& centre_m, std::size_t count) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> beside_m(-8.0, 8.0);
  std::uniform_real_distribution<double> yaw_rad(-kPi, kPi);
  std::uniform_int_distribution<int> session(0, 3);
  std::vector<Sight> sights;
  for (std::size_t i = 0; i < count; ++i) {
    sights.push_back(
        {centre_m + Eigen::Vector2d(beside_m(random), beside_m(random)), yaw_rad(random), session(random)});
  }
  return sights;
}

TEST(SightGrid, AnswersAsALookAtAllDoes) {
  for (const Eigen::Vector2d& centre_m : {Eigen::Vector2d(0, 0), Eigen::Vector2d(-1e6, 1e6), Eigen::Vector2d(1e6, -1e6),
                                          Eigen::Vector2d(0, -1e6), Eigen::Vector2d(1e6, 1e6)}) {
    const std::vector<Sight> sights = sightsAround(centre_m, 12);
    SightGrid grid;
    for (const Sight& sight : sights) grid.add(sight.position_m, sight.yaw_rad, sight.session);
    for (const Sight& here : sightsAround(centre_m, 300)) {
      bool other = false;
      bool earlier = false;
      bool opposite = false;
      for (const Sight& sight : sights) {
        if (!isHere(here, sight)) continue;
        other |= octantsBetween(here, sight) <= 1 && sight.session != here.session;
        earlier |= octantsBetween(here, sight) <= 1 && sight.session < here.session;
        opposite |= octantsBetween(here, sight) >= 3;
      }
      EXPECT_EQ(grid.otherSession(here.position_m, here.yaw_rad, here.session), other);
      EXPECT_EQ(grid.earlierSession(here.position_m, here.yaw_rad, here.session), earlier);
      EXPECT_EQ(grid.oppositeWay(here.position_m, here.yaw_rad), opposite);
    }
  }
}

TEST(SightGrid, CellsAreCountedOnce) {
  SightGrid grid;
  for (const double east_m : {-1e6, -2.6, -2.4, -0.1, 0.1, 2.4, 2.6, 1e6}) {
    grid.add({east_m, 0.0}, 0.0, 0);
    grid.add({east_m, 0.0}, kPi, 1);
  }
  EXPECT_EQ(grid.cells(), 6U);
}

}  // namespace
}  // namespace visual_localization

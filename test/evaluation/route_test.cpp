#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "evaluation/place_recogniser.h"

namespace visual_localization {
namespace {

using ::testing::ElementsAre;

std::vector<std::size_t> within(const Route& route, std::size_t radius, std::size_t centre) {
  std::vector<std::size_t> images;
  route.forEachWithin(radius, centre, [&images](std::size_t image) { images.push_back(image); });
  return images;
}

TEST(Route, ClosedRouteWrapsInBothDirections) {
  const Route route(5, true);
  EXPECT_EQ(route.at(4, 1), 0u);
  EXPECT_EQ(route.at(0, -1), 4u);
  EXPECT_EQ(route.at(1, -12), 4u);
  EXPECT_EQ(route.at(1, 14), 0u);
  EXPECT_EQ(route.distance(0, 4), 1u);
  EXPECT_EQ(route.distance(1, 3), 2u);
}

TEST(Route, OpenRouteEnds) {
  const Route route(5, false);
  EXPECT_EQ(route.at(3, 1), 4u);
  EXPECT_EQ(route.at(4, 1), std::nullopt);
  EXPECT_EQ(route.at(0, -1), std::nullopt);
  EXPECT_EQ(route.distance(0, 4), 4u);
}

TEST(Route, NeighboursAreVisitedOnceAndInOrder) {
  EXPECT_THAT(within(Route(6, true), 1, 0), ElementsAre(5, 0, 1));
  EXPECT_THAT(within(Route(6, true), 2, 5), ElementsAre(3, 4, 5, 0, 1));
  EXPECT_THAT(within(Route(6, false), 1, 0), ElementsAre(0, 1));
  EXPECT_THAT(within(Route(6, false), 2, 5), ElementsAre(3, 4, 5));
}

TEST(Route, RadiusBeyondTheRouteVisitsAllOfItOnce) {
  EXPECT_THAT(within(Route(4, true), 100, 0), ElementsAre(3, 0, 1, 2));
  EXPECT_THAT(within(Route(5, true), 100, 4), ElementsAre(2, 3, 4, 0, 1));
  EXPECT_THAT(within(Route(4, false), 100, 2), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(within(Route(1, true), 3, 0), ElementsAre(0));
  EXPECT_THAT(within(Route(2, true), 3, 1), ElementsAre(1, 0));
}

}  // namespace
}  // namespace visual_localization

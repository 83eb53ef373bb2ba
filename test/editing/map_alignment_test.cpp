#include "editing/map_alignment.h"

#include <gtest/gtest.h>

#include "test/editing/edited_street.h"

namespace visual_localization {
namespace {

using test::EditedStreet;

PlacedMap placed(const std::shared_ptr<const TrainingMap>& map) {
  return {map, std::vector<PoseCorrection>(map->size())};
}

/// Mean difference of their errors over the images of the second.
double apart_m(const TrainingMap& first, const TrainingMap& second, const std::vector<PoseCorrection>& corrections,
               std::size_t begin) {
  double sum_m = 0.0;
  for (std::size_t i = 0; i < second.size(); ++i) {
    const Eigen::Vector3d of_first = first.geometry(begin + i)->camera.position_m - EditedStreet::truth_m(0, begin + i);
    const Eigen::Vector3d of_second =
        corrections[i].of(second.geometry(i)->camera).position_m - EditedStreet::truth_m(1, begin + i);
    sum_m += (of_first - of_second).head<2>().norm();
  }
  return sum_m / static_cast<double>(second.size());
}

TEST(MapAlignment, TheSamePlaceLiesOnce) {
  const EditedStreet street;
  const auto first = street.mapOfDay(0, {0.0, 0.0});
  const auto second = street.mapOfDay(1, {1.5, -1.0});
  const std::vector<PoseCorrection> none(second->size());
  EXPECT_GT(apart_m(*first, *second, none, 0), 1.5);
  const MapAlignment alignment = align(*second, first->frame(), {placed(first)}, 2);
  EXPECT_LT(apart_m(*first, *second, alignment.corrections, 0), 0.05);
  EXPECT_GE(alignment.tied, second->size() - 3);
  EXPECT_NEAR(alignment.apart_m, std::hypot(1.5, 1.0), 0.2);
  EXPECT_LT(alignment.left_m, 0.05);
}

TEST(MapAlignment, DoesNotDependOnTheNumberOfThreads) {
  const EditedStreet street;
  const auto first = street.mapOfDay(0, {0.0, 0.0});
  const auto second = street.mapOfDay(1, {0.5, 0.5});
  const MapAlignment one = align(*second, first->frame(), {placed(first)}, 1);
  const MapAlignment four = align(*second, first->frame(), {placed(first)}, 4);
  for (std::size_t i = 0; i < second->size(); ++i) {
    EXPECT_EQ(one.corrections[i].shift_m, four.corrections[i].shift_m);
    EXPECT_EQ(one.corrections[i].turn.coeffs(), four.corrections[i].turn.coeffs());
  }
}

TEST(MapAlignment, AnImageThatAnotherMapLocatesIsKnownAsWellAsThatMap) {
  const EditedStreet street;
  const auto first = street.mapOfDay(0, {0.0, 0.0});
  const auto second = street.mapOfDay(1, {0.5, 0.5});
  const MapAlignment alignment = align(*second, first->frame(), {placed(first)}, 1);
  std::size_t decided = 0;
  for (std::size_t i = 0; i < second->size(); ++i) {
    if (!alignment.covariances[i]) continue;
    ++decided;
    const double of_first = std::sqrt(first->geometry(i)->covariance(0, 0));
    EXPECT_GE(std::sqrt((*alignment.covariances[i])(0, 0)), of_first);
    EXPECT_LT(std::sqrt((*alignment.covariances[i])(0, 0)), of_first + 0.1);
  }
  EXPECT_EQ(decided, alignment.tied);
}

TEST(MapAlignment, WhereNothingIsSharedFixesDecide) {
  const EditedStreet street;
  const auto first = street.mapOfDay(0, {0.0, 0.0}, 0, 10);
  const auto second = street.mapOfDay(1, {0.5, 0.5}, 25, 45);
  const MapAlignment alignment = align(*second, first->frame(), {placed(first)}, 1);
  EXPECT_EQ(alignment.tied, 0U);
  for (const PoseCorrection& correction : alignment.corrections) EXPECT_TRUE(correction.shift_m.isZero(0.0));
}

TEST(MapAlignment, APlacedMapThatMovedTakesTheNextOneAlong) {
  const EditedStreet street;
  const auto first = street.mapOfDay(0, {0.0, 0.0}, 0, 30);
  const auto second = street.mapOfDay(1, {1.0, 0.0}, 0, 45);
  const auto third = street.mapOfDay(2, {-1.0, 0.5}, 30, 45);
  std::vector<PlacedMap> maps{placed(first)};
  maps.push_back({second, align(*second, first->frame(), maps, 1).corrections});
  const MapAlignment alignment = align(*third, first->frame(), maps, 1);
  ASSERT_GT(alignment.tied, 10U);
  for (std::size_t i = 0; i < third->size(); ++i) {
    const Eigen::Vector3d of_second =
        maps[1].corrections[30 + i].of(second->geometry(30 + i)->camera).position_m - EditedStreet::truth_m(1, 30 + i);
    const Eigen::Vector3d of_third =
        alignment.corrections[i].of(third->geometry(i)->camera).position_m - EditedStreet::truth_m(2, 30 + i);
    EXPECT_LT((of_second - of_third).head<2>().norm(), 0.1) << i;
  }
}

}  // namespace
}  // namespace visual_localization

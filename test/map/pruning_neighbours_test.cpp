#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/numbers.h"
#include "map/extraction_pool.h"
#include "map/map_geometry.h"
#include "test/support/example_map.h"

namespace visual_localization {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

struct Place {
  double east_m;
  double yaw_rad;
  int session;
};

std::shared_ptr<const TrainingMap> mapOfPlaces(const std::vector<Place>& places) {
  std::vector<TrainingImage> images(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    images[i].position_m = {places[i].east_m, 0.0};
    images[i].yaw_rad = places[i].yaw_rad;
    images[i].session = places[i].session;
  }
  MapHeader header;
  header.datum = {48.5, 9.05, 0.0};
  header.image_size = {320, 240};
  header.sessions = {{"a"}, {"b"}, {"unused"}};
  return std::make_shared<const TrainingMap>(header, std::move(images));
}

TEST(PruningNeighbours, AreTheTwoNearest) {
  const auto map = mapOfPlaces({{0, 0, 0}, {1, 0, 0}, {2.5, 0, 0}, {3, 0, 0}, {9, 0, 0}});
  const PruningNeighbours neighbours(*map);
  EXPECT_THAT(neighbours.of(0), ElementsAre(1U, 2U));
  EXPECT_THAT(neighbours.of(2), ElementsAre(3U, 1U));
  EXPECT_THAT(neighbours.of(4), ElementsAre(3U, 2U));
}

TEST(PruningNeighbours, AreOfTheSameSession) {
  const auto map = mapOfPlaces({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 0, 1}, {1, 0, 1}, {2, 0, 1}});
  const PruningNeighbours neighbours(*map);
  EXPECT_THAT(neighbours.of(0), ElementsAre(1U, 2U));
  EXPECT_THAT(neighbours.of(4), ElementsAre(3U, 5U));
}

TEST(PruningNeighbours, FaceTheSameWay) {
  // There and back again; beyond the first dozens all others face the other way.
  std::vector<Place> places{{0, 0, 0}, {100, 0, 0}, {101, 0.3, 0}};
  for (int i = 0; i < 60; ++i) places.push_back({0.1 * i, kPi, 0});
  const auto map = mapOfPlaces(places);
  const PruningNeighbours neighbours(*map);
  EXPECT_THAT(neighbours.of(0), ElementsAre(1U, 2U));
  EXPECT_THAT(neighbours.of(1), ElementsAre(2U, 0U));
  EXPECT_THAT(neighbours.of(3), ElementsAre(4U, 5U));
}

TEST(PruningNeighbours, AreFoundBehindAThousandThatFaceAnotherWay) {
  std::vector<Place> places{{0, 0, 0}};
  for (int i = 1; i <= 1000; ++i) places.push_back({0.001 * i, kPi, 0});
  places.push_back({2, 0, 0});
  for (int i = 1; i <= 100; ++i) places.push_back({2 + 0.001 * i, kPi, 0});
  EXPECT_THAT(PruningNeighbours(*mapOfPlaces(places)).of(0), ElementsAre(1001U));
}

TEST(PruningNeighbours, AreNotLookedForWithoutEnd) {
  std::vector<Place> places{{0, 0, 0}};
  for (int i = 1; i <= 1023; ++i) places.push_back({0.001 * i, kPi, 0});
  places.push_back({2, 0, 0});
  EXPECT_THAT(PruningNeighbours(*mapOfPlaces(places)).of(0), IsEmpty());
}

TEST(PruningNeighbours, AnImageOnItsOwnHasNone) {
  const auto map = mapOfPlaces({{0, 0, 0}, {0.5, 0, 1}, {1, 0, 1}});
  const PruningNeighbours neighbours(*map);
  EXPECT_THAT(neighbours.of(0), IsEmpty());
  EXPECT_THAT(neighbours.of(1), ElementsAre(2U));
}

TEST(KeepFeatures, KeepsTheLandmarksThatTheyShow) {
  TrainingImage image = test::exampleImages(2, 8).back();
  const TrainingImage all = image;
  image.geometry = test::exampleGeometry(8);  // features 1, 3, 5 and 7 show landmarks
  const std::vector<SeenLandmark> landmarks = image.geometry->landmarks;
  keepFeatures({0, 3, 4, 5}, image);
  ASSERT_EQ(image.local.size(), 4U);
  EXPECT_EQ(image.local.keypoints()[3].x_px, all.local.keypoints()[5].x_px);
  ASSERT_EQ(image.geometry->landmarks.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(image.geometry->landmarks[i].feature, 1U + 2U * i);
    EXPECT_EQ(image.geometry->landmarks[i].id, landmarks[1 + i].id);
    EXPECT_EQ(image.geometry->landmarks[i].offset_m, landmarks[1 + i].offset_m);
  }
  keepFeatures({}, image);
  EXPECT_TRUE(image.local.empty());
  EXPECT_TRUE(image.geometry->landmarks.empty());
}

TEST(KeepFeatures, NeedsNoGeometry) {
  TrainingImage image = test::exampleImages(2, 8).back();
  image.geometry.reset();
  keepFeatures({7}, image);
  EXPECT_EQ(image.local.size(), 1U);
  EXPECT_FALSE(image.geometry);
}

}  // namespace
}  // namespace visual_localization

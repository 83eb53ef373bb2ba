#include <cstdint>
#include <utility>

#include <gtest/gtest.h>

#include "survey/map_survey.h"
#include "test/support/example_map.h"

namespace visual_localization {
namespace {

/// At (0, 10 * i, 2) m with these landmarks 1 m above each other.
TrainingImage imageWith(int i, int session, const std::vector<std::uint32_t>& ids) {
  std::mt19937 random(1);
  TrainingImage image;
  image.session = session;
  image.position_m = {0.0, 10.0 * i};
  image.local = test::randomFeatures(ids.size(), random);
  image.geometry = ImageGeometry();
  image.geometry->camera.position_m = {0.0, 10.0 * i, 2.0};
  for (std::uint32_t k = 0; k < ids.size(); ++k) {
    image.geometry->landmarks.push_back({k, ids[k], {1.0F, 0.0F, static_cast<float>(k)}, 0.1F, 0.1F});
  }
  return image;
}

TrainingMap someMap() {
  std::vector<TrainingImage> images;
  images.push_back(imageWith(0, 0, {7, 8}));
  images.push_back(imageWith(1, 0, {8, 9}));
  images.push_back(imageWith(2, 1, {9, 10, 11}));
  return TrainingMap(test::exampleHeader(), std::move(images));
}

TEST(LandmarkPoints, EachLandmarkStandsWhereItsFirstImageHasIt) {
  const auto points = landmarkPoints(someMap(), 100, 100);
  ASSERT_EQ(points.size(), 5U);
  EXPECT_EQ(points[1].position_m, Eigen::Vector3d(1.0, 0.0, 3.0)) << "number 8";
  EXPECT_EQ(points[2].position_m, Eigen::Vector3d(1.0, 10.0, 3.0)) << "number 9";
  EXPECT_EQ(points[2].session, 0);
  EXPECT_EQ(points[3].session, 1);
}

TEST(LandmarkPoints, OfMoreThanAskedForTheyAreChosenEvenly) {
  const auto of_all_images = landmarkPoints(someMap(), 100, 4);
  ASSERT_EQ(of_all_images.size(), 3U) << "every second of five";
  EXPECT_EQ(of_all_images[1].position_m.y(), 10.0);
  EXPECT_EQ(landmarkPoints(someMap(), 2, 100).size(), 5U) << "7, 8 of the first and 9, 10, 11 of the third";
  EXPECT_EQ(landmarkPoints(someMap(), 1, 100).size(), 2U);
}

TEST(LandmarkPoints, AMapOfPlacesHasNone) {
  TrainingImage place = imageWith(0, 0, {1});
  place.geometry.reset();
  EXPECT_TRUE(landmarkPoints(TrainingMap(test::exampleHeader(), {place}), 1, 1).empty());
}

}  // namespace
}  // namespace visual_localization

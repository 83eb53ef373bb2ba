#include "visual_localization/map/training_map.h"

#include <algorithm>
#include <limits>
#include <random>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/support/example_map.h"

namespace visual_localization {
namespace {

std::vector<TrainingImage> imagesAt(const std::vector<Eigen::Vector2d>& positions) {
  std::vector<TrainingImage> images(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) images[i].position_m = positions[i];
  return images;
}

TrainingMap mapAt(const std::vector<Eigen::Vector2d>& positions) {
  return {test::exampleHeader(), imagesAt(positions)};
}

TEST(TrainingMap, OneImageIsNearestToEverything) {
  const TrainingMap map = mapAt({{3.0, 4.0}});
  EXPECT_EQ(map.nearest({0.0, 0.0}).image, 0U);
  EXPECT_DOUBLE_EQ(map.nearest({0.0, 0.0}).distance_m, 5.0);
  EXPECT_EQ(map.nearest({0.0, 0.0}, 5).size(), 1U);
  EXPECT_TRUE(map.area().range().isZero());
}

TEST(TrainingMap, KnowsWhichImagesHaveAGeometry) {
  std::vector<TrainingImage> images = test::exampleImages(4, 6);
  EXPECT_FALSE(mapAt({{3.0, 4.0}}).hasGeometry());
  const TrainingMap map(test::exampleHeader(), images);
  EXPECT_EQ(map.geometryCount(), 2U);
  EXPECT_EQ(map.geometry(3), nullptr);
  ASSERT_NE(map.geometry(2), nullptr);
  EXPECT_TRUE(test::same(*map.geometry(2), images[2].geometry));
}

TEST(TrainingMap, RefusesLandmarksOfFeaturesThatAreNotThere) {
  std::vector<TrainingImage> images = test::exampleImages(4, 6);
  images[1].geometry->landmarks.back().feature = 6;
  EXPECT_THROW(TrainingMap(test::exampleHeader(), images), std::invalid_argument);
}

TEST(TrainingMap, FirstOfEquallyDistantImagesComesFirst) {
  const TrainingMap map = mapAt({{1.0, 0.0}, {-1.0, 0.0}, {0.0, 1.0}, {0.0, -1.0}});
  std::vector<std::size_t> order;
  for (const Neighbour& neighbour : map.nearest({0.0, 0.0}, 4)) order.push_back(neighbour.image);
  EXPECT_THAT(order, testing::ElementsAre(0, 1, 2, 3));
}

TEST(TrainingMap, ManyImagesAtOnePlaceKeepTheirOrder) {
  const TrainingMap map = mapAt(std::vector<Eigen::Vector2d>(100, Eigen::Vector2d(7.0, 7.0)));
  const std::vector<Neighbour> found = map.nearest({7.0, 7.0}, 3);
  ASSERT_EQ(found.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(found[i].image, i);
}

TEST(TrainingMap, NearestFacingAreTheOthersThatLookTheSameWay) {
  std::vector<TrainingImage> images = imagesAt({{0.0, 0.0}, {1.0, 0.0}, {2.0, 0.0}, {3.0, 0.0}, {9.0, 0.0}});
  images[1].yaw_rad = 3.0;
  images[2].yaw_rad = 1.5;
  const TrainingMap map(test::exampleHeader(), images);
  std::vector<Neighbour> found;
  const auto facing = [&](std::size_t i, std::size_t count, double radius_m) {
    map.nearestFacing(i, count, radius_m, found);
    std::vector<std::size_t> others;
    for (const Neighbour& neighbour : found) others.push_back(neighbour.image);
    return others;
  };
  EXPECT_THAT(facing(0, 5, 100.0), testing::ElementsAre(2, 3, 4));
  EXPECT_THAT(facing(0, 5, 3.0), testing::ElementsAre(2, 3));
  EXPECT_THAT(facing(0, 3, 100.0), testing::ElementsAre(2));
  EXPECT_THAT(facing(0, 2, 100.0), testing::ElementsAre(2, 3, 4)) << "none of two, so eight are looked at";
  EXPECT_THAT(facing(0, 2, 1.5), testing::IsEmpty());
  EXPECT_THAT(facing(1, 5, 100.0), testing::ElementsAre(2));
}

TEST(TrainingMap, NearestFacingLooksAtAThousandAtMost) {
  for (const std::size_t before : {1022U, 1023U}) {
    std::vector<Eigen::Vector2d> positions{{0.0, 0.0}};
    for (std::size_t i = 1; i <= before; ++i) positions.emplace_back(0.001 * static_cast<double>(i), 0.0);
    positions.emplace_back(2.0, 0.0);
    std::vector<TrainingImage> images = imagesAt(positions);
    for (std::size_t i = 1; i <= before; ++i) images[i].yaw_rad = 3.0;
    std::vector<Neighbour> found;
    TrainingMap(test::exampleHeader(), images).nearestFacing(0, 16, 100.0, found);
    EXPECT_EQ(found.size(), before == 1022U ? 1U : 0U);
  }
}

TEST(TrainingMap, CollinearImages) {
  std::vector<Eigen::Vector2d> positions;
  for (int i = 0; i < 50; ++i) positions.emplace_back(2.0 * i, 0.0);
  const TrainingMap map = mapAt(positions);
  EXPECT_EQ(map.nearest({40.9, 3.0}).image, 20U);
  EXPECT_DOUBLE_EQ(map.area().range().x(), 98.0);
  EXPECT_DOUBLE_EQ(map.area().range().y(), 0.0);
}

TEST(TrainingMap, AgreesWithLookingAtEveryImage) {
  std::mt19937 random(5);
  std::uniform_int_distribution<int> grid(0, 30);  // a coarse grid makes ties
  std::vector<Eigen::Vector2d> positions;
  for (int i = 0; i < 400; ++i) positions.emplace_back(grid(random), grid(random));
  const TrainingMap map = mapAt(positions);
  for (int query = 0; query < 500; ++query) {
    const Eigen::Vector2d place(0.5 * grid(random), 0.5 * grid(random));
    std::vector<std::pair<double, std::size_t>> expected;
    for (std::size_t i = 0; i < positions.size(); ++i) expected.emplace_back((positions[i] - place).squaredNorm(), i);
    std::sort(expected.begin(), expected.end());
    const std::vector<Neighbour> found = map.nearest(place, 7);
    ASSERT_EQ(found.size(), 7U);
    for (std::size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found[i].image, expected[i].second);
    EXPECT_EQ(map.nearest(place).image, expected.front().second);
  }
}

TEST(TrainingMap, OrderOfImagesDoesNotMatterForTheNearest) {
  std::vector<TrainingImage> images = test::exampleImages(60);
  const TrainingMap map(test::exampleHeader(), images);
  std::shuffle(images.begin(), images.end(), std::mt19937(3));
  const TrainingMap shuffled(test::exampleHeader(), images);
  for (double x = -60.0; x < 60.0; x += 3.7) {
    const Neighbour a = map.nearest({x, 0.3 * x});
    const Neighbour b = shuffled.nearest({x, 0.3 * x});
    EXPECT_EQ(map.pose(a.image).stamp_ns, shuffled.pose(b.image).stamp_ns);
    EXPECT_DOUBLE_EQ(a.distance_m, b.distance_m);
  }
}

TEST(TrainingMap, RefusesWhatIsNoMap) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(mapAt({}), std::invalid_argument);
  EXPECT_THROW(mapAt({{0.0, nan}}), std::invalid_argument);
  std::vector<TrainingImage> images = test::exampleImages(2);
  images[1].session = 2;
  EXPECT_THROW(TrainingMap(test::exampleHeader(), images), std::invalid_argument);
  images[1].session = -1;
  EXPECT_THROW(TrainingMap(test::exampleHeader(), images), std::invalid_argument);
  images = test::exampleImages(2);
  images[1].yaw_rad = nan;
  EXPECT_THROW(TrainingMap(test::exampleHeader(), images), std::invalid_argument);
  MapHeader header = test::exampleHeader();
  header.image_size = {0, 240};
  EXPECT_THROW(TrainingMap(header, test::exampleImages(2)), std::invalid_argument);
}

TEST(TrainingMap, RefusesStampsWhoseDifferenceIsNoTime) {
  constexpr std::int64_t kFarthest_ns = 4'294'967'296'000'000'000;
  auto images = test::exampleImages(2);
  images[0].stamp_ns = -kFarthest_ns;
  images[1].stamp_ns = kFarthest_ns;
  EXPECT_NO_THROW(TrainingMap(test::exampleHeader(), images));
  for (const std::int64_t stamp_ns : {kFarthest_ns + 1, -kFarthest_ns - 1, std::numeric_limits<std::int64_t>::max(),
                                      std::numeric_limits<std::int64_t>::min()}) {
    images[1].stamp_ns = stamp_ns;
    EXPECT_THROW(TrainingMap(test::exampleHeader(), images), std::invalid_argument) << stamp_ns;
  }
}

TEST(TrainingMap, NowhereHasNoNearestImage) {
  const TrainingMap map = mapAt({{0.0, 0.0}});
  const Eigen::Vector2d nowhere(std::numeric_limits<double>::infinity(), 0.0);
  EXPECT_THROW(map.nearest(nowhere), std::invalid_argument);
  EXPECT_TRUE(map.nearest(nowhere, 3).empty());
  EXPECT_TRUE(map.nearest({0.0, 0.0}, 0).empty());
}

TEST(TrainingMap, RefusesACameraOrAMaskForImagesOfAnotherSize) {
  MapHeader header = test::exampleHeader();
  header.sessions[0].camera = test::exampleCamera().scaledTo({640, 480});
  EXPECT_THROW(TrainingMap(header, test::exampleImages(2)), std::invalid_argument);
  header = test::exampleHeader();
  header.sessions[0].mask = test::exampleMask().scaledTo({160, 120});
  EXPECT_THROW(TrainingMap(header, test::exampleImages(2)), std::invalid_argument);
  EXPECT_NO_THROW(TrainingMap(test::exampleHeader(), test::exampleImages(2)));
}

}  // namespace
}  // namespace visual_localization

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "map/feature_store.h"
#include "survey/map_survey.h"
#include "test/support/example_map.h"
#include "visual_localization/features/sift.h"

namespace visual_localization {
namespace {

/// Replaces the features `first` to `last` of an image by others.
LocalFeatures withOthers(const LocalFeatures& features, std::size_t first, std::size_t last, unsigned seed) {
  std::mt19937 random(seed);
  const LocalFeatures others = test::randomFeatures(features.size(), random);
  std::vector<std::uint8_t> descriptors = features.bytes();
  const auto at = [](std::size_t i) { return static_cast<std::ptrdiff_t>(i * kSiftDimension); };
  std::copy(others.bytes().begin() + at(first), others.bytes().begin() + at(last), descriptors.begin() + at(first));
  return LocalFeatures(features.keypoints(), descriptors);
}

/// A street of 60 m with an image a metre, each with half its features from the one before. `twins`: so many images
/// from 40 on look like the ones from 5 on.
std::vector<TrainingImage> street(std::size_t twins) {
  std::mt19937 random(7);
  std::vector<TrainingImage> images(60);
  for (std::size_t i = 0; i < images.size(); ++i) {
    images[i].stamp_ns = static_cast<std::int64_t>(i) * 1'000'000'000;
    images[i].position_m = {static_cast<double>(i), 0.0};
    const auto seed = static_cast<unsigned>(i);
    images[i].local = i == 0 ? test::randomFeatures(60, random)
                             : withOthers(images[i - 1].local, i % 2 == 0 ? 0 : 30, i % 2 == 0 ? 30 : 60, seed);
    images[i].global.wgoh = test::randomHistogram(random);
    images[i].global.wgii = test::randomHistogram(random);
  }
  for (std::size_t t = 0; t < twins; ++t) {
    images[40 + t].local = withOthers(images[5 + t].local, 0, 15, 1000 + static_cast<unsigned>(t));
    images[40 + t].global = images[5 + t].global;
  }
  return images;
}

TrainingMap mapOf(std::vector<TrainingImage> images) { return {test::exampleHeader(), std::move(images)}; }

TEST(AmbiguousPlaces, AStreetWithoutTwinsHasNone) {
  const AmbiguousPlaces found = findAmbiguousPlaces(mapOf(street(0)));
  EXPECT_EQ(found.asked, 60U);
  EXPECT_EQ(found.stride, 1U);
  EXPECT_TRUE(found.images.empty());
  EXPECT_TRUE(found.stretches.empty());
}

TEST(AmbiguousPlaces, FindsBothOfTwoPlacesThatLookAlike) {
  const AmbiguousPlaces found = findAmbiguousPlaces(mapOf(street(4)));
  ASSERT_EQ(found.images.size(), 8U);
  EXPECT_EQ(found.images[0].image, 5U);
  EXPECT_EQ(found.images[0].twin, 40U);
  EXPECT_GE(found.images[0].similarity, 0.7 * found.images[0].near_similarity);
  EXPECT_EQ(found.images[4].image, 40U);
  EXPECT_EQ(found.images[4].twin, 5U);
  ASSERT_EQ(found.stretches.size(), 2U);
  EXPECT_EQ(found.stretches[0].first, 5U);
  EXPECT_EQ(found.stretches[0].last, 8U);
  EXPECT_DOUBLE_EQ(found.stretches[0].length_m, 3.0);
  EXPECT_GE(found.global_only, 8U);
}

TEST(AmbiguousPlaces, ATwinOfAnotherSessionAtTheSamePlaceIsNoRival) {
  std::vector<TrainingImage> images = street(0);
  std::vector<TrainingImage> again = images;
  for (TrainingImage& image : again) {
    image.session = 1;
    image.position_m.y() = 1.0;
  }
  images.insert(images.end(), again.begin(), again.end());
  EXPECT_TRUE(findAmbiguousPlaces(mapOf(std::move(images))).images.empty());
}

TEST(AmbiguousPlaces, OfALargeMapOnlySoManyAreAsked) {
  AmbiguityConfig config;
  config.most_images = 20;
  std::size_t calls = 0;
  const AmbiguousPlaces found = findAmbiguousPlaces(mapOf(street(0)), config, [&](std::size_t done, std::size_t total) {
    EXPECT_EQ(done, ++calls);
    EXPECT_EQ(total, 20U);
  });
  EXPECT_EQ(found.stride, 3U);
  EXPECT_EQ(found.asked, 20U);
  EXPECT_EQ(calls, 20U);
}

TEST(AmbiguousPlaces, EndsWhenThereIsNoWorkLeft) {
  AmbiguityConfig config;
  config.most_work = 200'000;
  const AmbiguousPlaces found = findAmbiguousPlaces(mapOf(street(0)), config);
  EXPECT_GT(found.asked, 0U);
  EXPECT_GT(found.unasked, 40U);
  EXPECT_EQ(found.asked + found.unasked, 60U);
}

TEST(AmbiguousPlaces, WorkIsWhatTheFeaturesAreAndNotWhatThePlacesClaim) {
  std::vector<TrainingImage> images = street(0);
  TrainingPoses poses;
  for (const TrainingImage& image : images) poses.add(image, 1);
  const TrainingMap map(test::exampleHeader(), poses, std::make_unique<MemoryFeatureStore>(std::move(images)));
  AmbiguityConfig config;
  config.most_work = 200'000;
  EXPECT_GT(findAmbiguousPlaces(map, config).unasked, 40U);
}

TEST(AmbiguousPlaces, AnImageWithoutANearOneCannotBeJudged) {
  std::vector<TrainingImage> images = street(4);
  for (TrainingImage& image : images) image.position_m *= 6.0;
  const AmbiguousPlaces found = findAmbiguousPlaces(mapOf(std::move(images)));
  EXPECT_TRUE(found.images.empty());
  EXPECT_EQ(found.asked, 0U);
  EXPECT_EQ(found.unasked, 0U);
  EXPECT_EQ(found.unjudged, 60U);
}

TEST(AmbiguousPlaces, ANearImageThatFacesAnotherWayIsNoNeighbour) {
  std::vector<TrainingImage> images = street(4);
  images[41].yaw_rad = kPi;
  for (TrainingImage& image : images) image.position_m *= 4.0;  // only 40 and 42 are near 41
  const AmbiguousPlaces found = findAmbiguousPlaces(mapOf(std::move(images)));
  EXPECT_EQ(found.asked, 59U);
  EXPECT_EQ(found.unjudged, 1U);
  for (const AmbiguousImage& image : found.images) EXPECT_NE(image.image, 41U);
}

TEST(AmbiguousPlaces, ANeighbourIsFoundAmongManyThatFaceAnotherWay) {
  std::vector<TrainingImage> images = street(0);
  TrainingImage standing = images[30];
  standing.yaw_rad = kPi;
  for (int i = 0; i < 40; ++i) images.push_back(standing);
  const AmbiguousPlaces found = findAmbiguousPlaces(mapOf(std::move(images)));
  EXPECT_EQ(found.asked, 100U);
}

TEST(AmbiguousPlaces, AStretchEndsWithItsSession) {
  std::vector<TrainingImage> images = street(4);
  for (std::size_t i = 7; i < images.size(); ++i) images[i].session = 1;
  AmbiguityConfig config;
  config.most_images = 12;
  const AmbiguousPlaces found = findAmbiguousPlaces(mapOf(std::move(images)), config);
  ASSERT_EQ(found.stride, 5U);
  ASSERT_EQ(found.images.size(), 2U);
  EXPECT_EQ(found.images[0].image, 5U);
  EXPECT_EQ(found.images[1].image, 40U);
  ASSERT_EQ(found.stretches.size(), 2U) << "7, 8 and 9 are of another session and were not compared";
  EXPECT_EQ(found.stretches[0].first, 5U);
  EXPECT_EQ(found.stretches[0].last, 6U);
  EXPECT_EQ(found.stretches[1].first, 40U);
  EXPECT_EQ(found.stretches[1].last, 44U);
}

TEST(AmbiguousPlaces, ImagesWithoutFeaturesAreNotAmbiguous) {
  std::vector<TrainingImage> images = street(4);
  for (TrainingImage& image : images) {
    image.local = {};
    image.global = {};
  }
  const AmbiguousPlaces found = findAmbiguousPlaces(mapOf(std::move(images)));
  EXPECT_TRUE(found.images.empty());
  EXPECT_EQ(found.global_only, 0U);
}

}  // namespace
}  // namespace visual_localization

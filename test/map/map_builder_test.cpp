#include "visual_localization/map/map_builder.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "test/support/temporary_folder.h"
#include "visual_localization/features/global_features.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr int kFixes = 40;

/// Five fixes a second for eight seconds, eastwards at 0.7 m/s.
std::vector<Fix> straightRound() {
  const LocalFrame frame({48.5, 9.05, 0.0});
  std::vector<Fix> fixes;
  for (int i = 0; i < kFixes; ++i) fixes.push_back({i * kSecond_ns / 5, frame.toGeodetic({0.14 * i, 0.0}), true});
  return fixes;
}

/// Blobs of random size and brightness; `shift_px` moves the scene.
cv::Mat scene(std::uint64_t seed, int shift_px) {
  cv::RNG random(seed);
  cv::Mat image(240, 320, CV_8UC1, cv::Scalar(128));
  for (int i = 0; i < 150; ++i) {
    const cv::Point centre(random.uniform(0, 400) - shift_px, random.uniform(0, 240));
    cv::circle(image, centre, random.uniform(2, 14), cv::Scalar(random.uniform(0, 255)), cv::FILLED, cv::LINE_AA);
  }
  return image;
}

TEST(MapBuilder, ImagesGetThePositionOfTheirStamp) {
  MapBuilder builder({});
  builder.beginSession("round", straightRound());
  for (int i = 0; i < 7; ++i) {
    ASSERT_TRUE(builder.wants(i * kSecond_ns));
    builder.addImage(i * kSecond_ns, scene(1, 4 * i));
  }
  const auto map = builder.build();
  ASSERT_EQ(map->size(), 7U);
  for (std::size_t i = 0; i < map->size(); ++i) {
    EXPECT_NEAR((map->position_m(i) - map->position_m(0)).norm(), 0.7 * static_cast<double>(i), 0.1);
    EXPECT_NEAR(map->yaw_rad(i), 0.0, 0.1);
    EXPECT_FALSE(map->preview(i).empty());
  }
  EXPECT_EQ(map->header().image_size, cv::Size(320, 240));
  ASSERT_EQ(map->header().sessions.size(), 1U);
  EXPECT_EQ(map->header().sessions[0].name, "round");
}

TEST(MapBuilder, CountsWhyImagesAreDropped) {
  MapBuilderConfig config;
  config.min_spacing_m = 1.0;
  MapBuilder builder(config);
  builder.beginSession("round", straightRound());
  EXPECT_FALSE(builder.wants(-kSecond_ns));
  ASSERT_TRUE(builder.wants(1 * kSecond_ns));
  builder.addImage(1 * kSecond_ns, scene(1, 0));
  EXPECT_FALSE(builder.wants(1 * kSecond_ns));
  EXPECT_FALSE(builder.wants(2 * kSecond_ns));
  ASSERT_TRUE(builder.wants(3 * kSecond_ns));
  builder.addImage(3 * kSecond_ns, {});
  ASSERT_TRUE(builder.wants(4 * kSecond_ns));
  builder.addImage(4 * kSecond_ns, cv::Mat(240, 320, CV_8UC3));
  ASSERT_TRUE(builder.wants(5 * kSecond_ns));
  builder.addImage(5 * kSecond_ns, cv::Mat(8, 320, CV_8UC1));
  EXPECT_FALSE(builder.wants(60 * kSecond_ns));
  EXPECT_EQ(builder.report().images_kept, 1U);
  EXPECT_EQ(builder.report().images_without_position, 2U);
  EXPECT_EQ(builder.report().images_disordered, 1U);
  EXPECT_EQ(builder.report().images_too_close, 1U);
  EXPECT_EQ(builder.report().images_unusable, 3U);
}

TEST(MapBuilder, PruningDropsWhatOnlyOneImageShows) {
  MapBuilder builder({});
  builder.beginSession("round", straightRound());
  for (int i = 0; i < 6; ++i) builder.addImage(i * kSecond_ns, scene(i == 3 ? 99U : 1U, 3 * i));
  const auto map = builder.build();
  EXPECT_LT(builder.report().features_kept, builder.report().features_extracted);
  // The odd one out shares almost nothing with its neighbours.
  EXPECT_LT(4 * map->featureCount(3), map->featureCount(1));
  EXPECT_GT(map->featureCount(1), 20U);
}

TEST(MapBuilder, OneImageKeepsAllItsFeatures) {
  MapBuilder builder({});
  builder.beginSession("round", straightRound());
  builder.addImage(kSecond_ns, scene(1, 0));
  EXPECT_EQ(builder.build()->size(), 1U);
  EXPECT_EQ(builder.report().features_kept, builder.report().features_extracted);
}

TEST(MapBuilder, OtherSizesAreResizedToTheFirst) {
  MapBuilder builder({});
  builder.beginSession("round", straightRound());
  builder.addImage(kSecond_ns, scene(1, 0));
  cv::Mat large;
  cv::resize(scene(1, 3), large, {640, 480});
  builder.addImage(2 * kSecond_ns, large);
  const auto map = builder.build();
  EXPECT_EQ(map->header().image_size, cv::Size(320, 240));
  for (const SiftKeypoint& keypoint : map->sift(1)->keypoints()) EXPECT_LT(keypoint.x_px, 320.0F);
}

TEST(MapBuilder, GlobalFeaturesAreThoseOfTheImageInTheMapsSize) {
  MapBuilder builder({});
  builder.beginSession("round", straightRound());
  builder.addImage(kSecond_ns, scene(1, 0));
  cv::Mat large;
  cv::resize(scene(1, 3), large, {640, 480});
  builder.addImage(2 * kSecond_ns, large);
  const auto map = builder.build();
  cv::Mat small;
  cv::resize(large, small, {320, 240}, 0.0, 0.0, cv::INTER_AREA);
  GlobalExtractor extractor;
  EXPECT_EQ(map->image(0).global.wgoh, extractor.extract(scene(1, 0)).wgoh);
  EXPECT_EQ(map->image(1).global.wgoh, extractor.extract(small).wgoh);
  EXPECT_EQ(map->image(1).global.wgii, extractor.extract(small).wgii);
}

TEST(MapBuilder, RoundsBecomeSessionsOfOneMap) {
  MapBuilder builder({});
  for (const char* name : {"first", "second"}) {
    builder.beginSession(name, straightRound());
    for (int i = 0; i < 3; ++i) {
      ASSERT_TRUE(builder.wants(i * kSecond_ns));
      builder.addImage(i * kSecond_ns, scene(1, 3 * i));
    }
  }
  const auto map = builder.build();
  EXPECT_EQ(map->size(), 6U);
  EXPECT_EQ(map->pose(2).session, 0);
  EXPECT_EQ(map->pose(3).session, 1);
}

TEST(MapBuilder, ARoundIsPrunedAsIfItWereAlone) {
  const auto add = [](MapBuilder& builder, const char* name, std::uint64_t seed) {
    builder.beginSession(name, straightRound());
    for (int i = 0; i < 7; ++i) builder.addImage(i * kSecond_ns, scene(seed, 4 * i));
  };
  MapBuilder alone({});
  add(alone, "sunny", 1);
  MapBuilder together({});
  add(together, "sunny", 1);
  add(together, "cloudy", 2);       // shows nothing of the same
  add(together, "sunny again", 1);  // shows exactly the same
  const auto one = alone.build();
  const auto three = together.build();
  ASSERT_EQ(three->size(), 3 * one->size());
  for (std::size_t i = 0; i < one->size(); ++i) {
    EXPECT_EQ(three->sift(i)->descriptors(), one->sift(i)->descriptors());
    EXPECT_EQ(three->featureCount(2 * one->size() + i), one->featureCount(i));
  }
}

TEST(MapBuilder, RoundsShareTheFrameOfTheFirst) {
  // The second one begins 2.8 m farther east, so with another first fix.
  const std::vector<Fix> fixes = straightRound();
  std::vector<Fix> second(fixes.begin() + 20, fixes.end());
  MapBuilder builder({});
  builder.beginSession("first", fixes);
  builder.addImage(6 * kSecond_ns, scene(1, 0));
  builder.beginSession("second", second);
  builder.addImage(6 * kSecond_ns, scene(1, 0));
  const auto map = builder.build();
  EXPECT_NEAR((map->position_m(0) - map->position_m(1)).norm(), 0.0, 0.05);
  EXPECT_NEAR(map->position_m(1).x(), 4.2, 0.05);
}

TEST(MapBuilder, CountsTheImagesOfEachRound) {
  MapBuilder builder({});
  builder.beginSession("first", straightRound());
  builder.addImage(1 * kSecond_ns, scene(1, 0));
  builder.addImage(2 * kSecond_ns, scene(1, 3));
  builder.beginSession("second", straightRound());
  cv::Mat wide;
  cv::resize(scene(1, 0), wide, {640, 200});
  builder.addImage(1 * kSecond_ns, wide);
  const auto& sessions = builder.report().session_images;
  ASSERT_EQ(sessions.size(), 2U);
  EXPECT_EQ(sessions[0].kept, 2U);
  EXPECT_EQ(sessions[0].recorded, cv::Size(320, 240));
  EXPECT_EQ(sessions[1].name, "second");
  EXPECT_EQ(sessions[1].recorded, cv::Size(640, 200));
}

TEST(MapBuilder, ARoundOfAnotherCityIsRefused) {
  // The other side of the earth lies at the datum again for a tangent plane.
  for (const GeodeticPoint& city : {GeodeticPoint{52.5, 13.4, 30.0}, GeodeticPoint{-48.5, 9.05 - 180.0, 0.0}}) {
    const LocalFrame frame(city);
    std::vector<Fix> fixes = straightRound();
    for (std::size_t i = 0; i < fixes.size(); ++i) {
      fixes[i].position = frame.toGeodetic({0.14 * static_cast<double>(i), 0.0});
    }
    MapBuilder builder({});
    builder.beginSession("here", straightRound());
    builder.addImage(kSecond_ns, scene(1, 0));
    try {
      builder.beginSession("there", fixes);
      ADD_FAILURE() << "accepted";
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), testing::AllOf(testing::HasSubstr("'there'"), testing::HasSubstr(" km away")));
    }
    EXPECT_EQ(builder.build()->size(), 1U) << "what came before stays";
  }
}

/// Two rounds along the same street, made with these resources.
std::string mapFile(const MapBuilderResources& resources, const std::string& path, MapBuildReport* report = nullptr) {
  MapBuilder builder({}, resources);
  for (const char* name : {"first", "second"}) {
    builder.beginSession(name, straightRound());
    for (int i = 0; i < 7; ++i) {
      EXPECT_TRUE(builder.wants(i * kSecond_ns));
      builder.addImage(i * kSecond_ns, scene(1, 3 * i));
    }
  }
  builder.save(path);
  if (report != nullptr) *report = builder.report();
  return test::readAll(path);
}

TEST(MapBuilder, TheFileDependsNeitherOnThreadsNorOnWhereImagesWait) {
  const test::TemporaryFolder folder;
  MapBuildReport one;
  MapBuildReport many;
  const std::string in_memory = mapFile({1, ""}, folder / "a.map", &one);
  EXPECT_EQ(in_memory, mapFile({5, ""}, folder / "b.map"));
  EXPECT_EQ(in_memory, mapFile({1, folder / "c.map"}, folder / "c.map"));
  EXPECT_EQ(in_memory, mapFile({3, folder / "d.map"}, folder / "d.map", &many));
  EXPECT_EQ(one.features_extracted, many.features_extracted);
  EXPECT_EQ(one.features_kept, many.features_kept);
  EXPECT_EQ(folder.names().size(), 4U) << "nothing is left behind";
}

TEST(MapBuilder, BuildsInMemoryWhatItSaves) {
  const test::TemporaryFolder folder;
  const std::string saved = mapFile({2, folder / "a.map"}, folder / "a.map");
  MapBuilder builder({});
  for (const char* name : {"first", "second"}) {
    builder.beginSession(name, straightRound());
    for (int i = 0; i < 7; ++i) builder.addImage(i * kSecond_ns, scene(1, 3 * i));
  }
  saveMap(*builder.build(), folder / "b.map");
  EXPECT_EQ(test::readAll(folder / "b.map"), saved);
}

TEST(MapBuilder, AFailedBuildLeavesNothing) {
  const test::TemporaryFolder folder;
  {
    MapBuilder builder({}, {2, folder / "a.map"});
    builder.beginSession("round", straightRound());
    EXPECT_THROW(builder.save(folder / "a.map"), std::runtime_error);
    builder.addImage(kSecond_ns, scene(1, 0));
    EXPECT_THROW(builder.save(folder / "absent/a.map"), MapStoreError);
  }
  EXPECT_EQ(folder.names().size(), 0U);
}

TEST(MapBuilder, DatumIsNotAnOutlier) {
  std::vector<Fix> fixes = straightRound();
  const GeodeticPoint believable = fixes[1].position;
  fixes[0].position = {0.0, 0.0, 0.0};
  MapBuilder builder({});
  builder.beginSession("round", fixes);
  builder.addImage(3 * kSecond_ns, scene(1, 0));
  EXPECT_NEAR(builder.build()->header().datum.latitude_deg, believable.latitude_deg, 1e-3);
}

TEST(MapBuilder, SaysWhatIsMissing) {
  MapBuilder builder({});
  EXPECT_THROW(builder.wants(0), std::logic_error);
  EXPECT_THROW(builder.build(), std::runtime_error);
  std::vector<Fix> blind = straightRound();
  for (Fix& fix : blind) fix.has_fix = false;
  for (const auto& fixes : {std::vector<Fix>{}, blind}) {
    try {
      builder.beginSession("dark", fixes);
      ADD_FAILURE() << "accepted";
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("'dark'"));
    }
  }
  MapBuilderConfig config;
  config.min_spacing_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_ANY_THROW(MapBuilder{config});
}

SessionCamera exampleCamera(cv::Size size) {
  cv::Mat grey(size, CV_8U, cv::Scalar(255));
  grey.rowRange(size.height / 2, size.height).setTo(0);
  const CameraModel model({{320, 240}, 266.0, 267.0, 159.5, 119.5, Distortion::kPlumbBob, {-0.1, 0.01, 0.0, 0.0}});
  return {model.scaledTo(size), Mask(grey)};
}

TEST(MapBuilder, CameraAndMaskAreScaledWithTheImages) {
  MapBuilder builder({});
  builder.beginSession("first", straightRound());
  builder.addImage(1 * kSecond_ns, scene(1, 0));
  builder.beginSession("second", straightRound(), exampleCamera({640, 480}));
  cv::Mat large;
  cv::resize(scene(1, 0), large, {640, 480});
  builder.addImage(1 * kSecond_ns, large);
  const auto map = builder.build();
  const std::vector<Session>& sessions = map->header().sessions;
  EXPECT_FALSE(sessions[0].camera);
  EXPECT_TRUE(sessions[0].mask.empty());
  EXPECT_EQ(sessions[1].camera, exampleCamera({640, 480}).model->scaledTo({320, 240}));
  EXPECT_TRUE(sessions[1].mask == exampleCamera({320, 240}).mask);
  ASSERT_GT(map->sift(0)->size(), 10U);
  ASSERT_GT(map->sift(1)->size(), 10U);
  float lowest_px = 0.0F;
  for (const SiftKeypoint& keypoint : map->sift(0)->keypoints()) lowest_px = std::max(lowest_px, keypoint.y_px);
  EXPECT_GT(lowest_px, 150.0F);
  for (const SiftKeypoint& keypoint : map->sift(1)->keypoints()) EXPECT_LT(keypoint.y_px, 120.0F);
}

TEST(MapBuilder, ACameraForImagesOfAnotherShapeIsRefused) {
  for (const bool mask : {false, true}) {
    SessionCamera camera = exampleCamera({320, 200});
    if (mask) camera.model.reset();
    MapBuilder builder({});
    builder.beginSession("round", straightRound(), camera);
    try {
      builder.addImage(1 * kSecond_ns, scene(1, 0));
      FAIL() << "accepted";
    } catch (const CameraError& error) {
      EXPECT_THAT(error.what(), testing::AllOf(testing::HasSubstr("session 'round'"),
                                               testing::HasSubstr("320 x 200 px, but the images have 320 x 240 px")));
    }
  }
}

}  // namespace
}  // namespace visual_localization

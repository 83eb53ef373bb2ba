#include "visual_localization/map/map_builder.h"

#include <limits>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "test/map/straight_round.h"
#include "test/support/refusal.h"
#include "test/support/temporary_folder.h"
#include "visual_localization/features/global_features.h"
#include "visual_localization/features/sift.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization {
namespace {

using test::kSecond_ns;
using test::scene;
using test::straightRound;

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

TEST(MapBuilder, PreviewsAreSmallJpegsOfTheImages) {
  MapBuilder builder(MapBuilderConfig{});
  builder.beginSession("round", straightRound());
  ASSERT_TRUE(builder.wants(0));
  builder.addImage(0, scene(1, 0));
  const cv::Mat preview = cv::imdecode(builder.build()->preview(0), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(preview.type(), CV_8UC1);
  ASSERT_EQ(preview.size(), cv::Size(80, 60));
  cv::Mat expected;
  cv::resize(scene(1, 0), expected, preview.size(), 0.0, 0.0, cv::INTER_AREA);
  EXPECT_LT(cv::norm(preview, expected, cv::NORM_L1) / static_cast<double>(expected.total()), 5.0);  // grey levels
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

/// As in the papers.
MapBuilderConfig pruning() {
  MapBuilderConfig config;
  config.prune = true;
  config.local.choose(Sift());
  return config;
}

TEST(MapBuilder, PruningDropsWhatOnlyOneImageShows) {
  MapBuilder builder(pruning());
  builder.beginSession("round", straightRound());
  for (int i = 0; i < 6; ++i) builder.addImage(i * kSecond_ns, scene(i == 3 ? 99U : 1U, 3 * i));
  const auto map = builder.build();
  EXPECT_LT(builder.report().features_kept, builder.report().features_extracted);
  // The odd one out shares almost nothing with its neighbours.
  EXPECT_LT(4 * map->featureCount(3), map->featureCount(1));
  EXPECT_GT(map->featureCount(1), 20U);
}

TEST(MapBuilder, OneImageKeepsAllItsFeatures) {
  MapBuilder builder(pruning());
  builder.beginSession("round", straightRound());
  builder.addImage(kSecond_ns, scene(1, 0));
  EXPECT_EQ(builder.build()->size(), 1U);
  EXPECT_EQ(builder.report().features_kept, builder.report().features_extracted);
}

/// One of each second.
std::shared_ptr<const TrainingMap> mapOfImages(const std::vector<cv::Mat>& images) {
  MapBuilder builder({});
  builder.beginSession("round", straightRound());
  std::int64_t stamp_ns = 0;
  for (const cv::Mat& image : images) builder.addImage(stamp_ns += kSecond_ns, image);
  return builder.build();
}

TEST(MapBuilder, OtherSizesAreResizedToTheFirst) {
  cv::Mat large;
  cv::resize(scene(1, 3), large, {640, 480});
  const auto map = mapOfImages({scene(1, 0), large});
  EXPECT_EQ(map->header().image_size, cv::Size(320, 240));
  for (const Keypoint& keypoint : map->local(1)->keypoints()) EXPECT_LT(keypoint.x_px, 320.0F);
}

TEST(MapBuilder, ImagesOfALargeCameraAreHalvedUntilTheyAreSmallEnough) {
  const auto sizeOf = [](double max_megapixels) {
    MapBuilderConfig config;
    config.max_megapixels = max_megapixels;
    config.geometry.enabled = false;
    MapBuilder builder(config);
    CameraModel camera({{320, 240}, 300.0, 300.0, 159.5, 119.5, Distortion::kPlumbBob, {}});
    builder.beginSession("round", straightRound(), {camera});
    for (int i = 0; i < 2; ++i) builder.addImage(i * kSecond_ns, scene(1, 4 * i));
    const auto map = builder.build();
    EXPECT_EQ(builder.report().session_images.front().recorded, cv::Size(320, 240));
    EXPECT_EQ(map->header().sessions.front().camera->intrinsics().size, map->header().image_size);
    return map->header().image_size;
  };
  EXPECT_EQ(sizeOf(MapBuilderConfig().max_megapixels), cv::Size(320, 240));
  EXPECT_EQ(sizeOf(0.0769), cv::Size(320, 240));
  EXPECT_EQ(sizeOf(0.076), cv::Size(160, 120));
  EXPECT_EQ(sizeOf(0.019), cv::Size(80, 60));
  EXPECT_EQ(sizeOf(1e-9), cv::Size(40, 30)) << "not smaller than features need";
  EXPECT_EQ(sizeOf(0.0), cv::Size(320, 240)) << "as recorded";
}

TEST(MapBuilder, TheFirstImagesDoNotDecideASizeThatIsGiven) {
  MapBuilder builder({});
  builder.beginSession("round", straightRound(), {{}, {}, {}, {320, 240}});
  for (int i = 1; i <= 2; ++i) builder.addImage(i * kSecond_ns, cv::Mat(20, 20, CV_8UC1, cv::Scalar(7)));
  EXPECT_FALSE(builder.wants(3 * kSecond_ns, {16384, 16384})) << "not worth decoding";
  ASSERT_TRUE(builder.wants(4 * kSecond_ns, {640, 480}));
  cv::Mat large;
  cv::resize(scene(1, 0), large, {640, 480});
  builder.addImage(4 * kSecond_ns, large);
  ASSERT_TRUE(builder.wants(5 * kSecond_ns, {320, 240}));
  builder.addImage(5 * kSecond_ns, scene(1, 3));
  const auto map = builder.build();
  EXPECT_EQ(map->size(), 2U);
  EXPECT_EQ(map->header().image_size, cv::Size(320, 240));
  EXPECT_EQ(builder.report().images_of_other_shape, 3U);
  const std::map<std::pair<int, int>, std::size_t> others{{{20, 20}, 2U}, {{640, 480}, 1U}, {{16384, 16384}, 1U}};
  EXPECT_EQ(builder.report().session_images.front().other_sizes, others);
}

TEST(MapBuilder, ASessionWhoseImagesNoMapMayHaveIsRefused) {
  MapBuilder builder({});
  builder.beginSession("round", straightRound(), {{}, {}, {}, {10000, 5000}});
  EXPECT_EQ(test::refusalOf<std::runtime_error>(
                [&] { builder.addImage(kSecond_ns, cv::Mat(100, 200, CV_8UC1, cv::Scalar(7))); }),
            "session 'round': its images are too large: 10000x5000 pixels, at most 16777216 are allowed and 16384 "
            "a side");
}

/// Drives for 20 s, stands for 30 s, drives for 20 s: 0.7 m/s, fixes with millimetres of noise.
std::vector<Fix> roundWithAStop() {
  const LocalFrame frame({48.5, 9.05, 0.0});
  std::vector<Fix> fixes;
  for (int i = 0; i < 350; ++i) {
    const double driven_s = 0.2 * (i < 100 ? i : i < 250 ? 100 : i - 150);
    fixes.push_back({i * kSecond_ns / 5, frame.toGeodetic({0.7 * driven_s, 0.001 * (i % 3)}), true});
  }
  return fixes;
}

TEST(MapBuilder, ARobotThatStandsGivesImagesForTenSeconds) {
  MapBuilder builder({});
  builder.beginSession("round", roundWithAStop());
  std::vector<int> wanted_s;
  for (int time_s = 0; time_s < 69; ++time_s) {
    if (builder.wants(time_s * kSecond_ns)) wanted_s.push_back(time_s);
  }
  EXPECT_NEAR(static_cast<double>(builder.report().images_standing), 20.0, 3.0);
  ASSERT_EQ(wanted_s.size() + builder.report().images_standing, 69U);
  EXPECT_EQ(wanted_s[27], 27) << "a robot may turn on its spot";
  EXPECT_EQ(wanted_s[wanted_s.size() - 16], 53) << "it drives on";
}

TEST(MapBuilder, ImagesThatNoMapMayHaveAreUnusable) {
  MapBuilder builder({});
  builder.beginSession("round", straightRound());
  builder.addImage(kSecond_ns, cv::Mat(4097, 4096, CV_8UC1, cv::Scalar(9)));
  builder.addImage(2 * kSecond_ns, cv::Mat(16, 16385, CV_8UC1, cv::Scalar(9)));
  builder.addImage(3 * kSecond_ns, scene(1, 0));
  EXPECT_EQ(builder.report().images_unusable, 2U);
  EXPECT_EQ(builder.build()->header().image_size, cv::Size(320, 240));
}

TEST(MapBuilder, GlobalFeaturesAreThoseOfTheImageInTheMapsSize) {
  cv::Mat large;
  cv::resize(scene(1, 3), large, {640, 480});
  const auto map = mapOfImages({scene(1, 0), large});
  cv::Mat small;
  cv::resize(large, small, {320, 240}, 0.0, 0.0, cv::INTER_AREA);
  GlobalExtractor extractor;
  EXPECT_EQ(map->image(0).global.wgoh, extractor.extract(scene(1, 0)).wgoh);
  EXPECT_EQ(map->image(1).global.wgoh, extractor.extract(small).wgoh);
  EXPECT_EQ(map->image(1).global.wgii, extractor.extract(small).wgii);
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
    EXPECT_THAT(test::refusalOf<std::runtime_error>([&] { builder.beginSession("dark", fixes); }),
                testing::HasSubstr("'dark'"));
  }
  MapBuilderConfig config;
  config.min_spacing_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_ANY_THROW(MapBuilder{config});
}

}  // namespace
}  // namespace visual_localization

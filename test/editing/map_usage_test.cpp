#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "editing/map_selection.h"
#include "test/support/example_map.h"
#include "test/support/refusal.h"

namespace visual_localization {
namespace {

using testing::AllOf;
using testing::HasSubstr;

MatchedLandmarks matched(std::size_t image, const std::vector<std::uint32_t>& inliers) {
  MatchedLandmarks landmarks{image, {}};
  for (const std::uint32_t feature : inliers) landmarks.landmarks.push_back({Eigen::Vector2f::Zero(), feature, true});
  landmarks.landmarks.push_back({Eigen::Vector2f::Zero(), 999, false});
  return landmarks;
}

std::string refusalOfUsage(const std::string& text) {
  return test::refusalOf<UsageFileError>([&] { MapUsage::fromCsv(text); });
}

/// `count` images on one spot, in two sessions by turns.
TrainingMap onOneSpot(std::size_t count) {
  auto images = test::exampleImages(count);
  for (std::size_t i = 0; i < count; ++i) {
    images[i].position_m = {1.0, 1.0};
    images[i].yaw_rad = 0.0;
    images[i].session = static_cast<int>(i % 2);
  }
  return TrainingMap(test::exampleHeader(), images);
}

TEST(MapUsage, CountsPosesAndTheLandmarksThatAgree) {
  const TrainingMap map(test::exampleHeader(), test::exampleImages(6));
  MapUsage usage;
  usage.add(map, matched(2, {1, 5}));
  usage.add(map, matched(2, {5}));
  usage.add(map, matched(4, {}));
  EXPECT_EQ(usage.find(map.pose(0).stamp_ns), nullptr);
  const auto* image = usage.find(map.pose(2).stamp_ns);
  ASSERT_NE(image, nullptr);
  EXPECT_EQ(image->poses, 2U);
  EXPECT_EQ(image->landmarks, (std::map<std::uint32_t, std::uint64_t>{{1, 1}, {5, 2}}));
}

TEST(MapUsage, ReadsWhatItWrites) {
  const TrainingMap map(test::exampleHeader(), test::exampleImages(6));
  MapUsage usage;
  usage.add(map, matched(2, {1, 5}));
  usage.add(map, matched(4, {}));
  const std::string text = usage.toCsv();
  EXPECT_EQ(MapUsage::fromCsv(text).toCsv(), text);
  MapUsage twice = MapUsage::fromCsv(text);
  twice.add(usage);
  EXPECT_EQ(twice.find(map.pose(2).stamp_ns)->poses, 2U);
  EXPECT_EQ(twice.find(map.pose(2).stamp_ns)->landmarks.at(5), 2U);
}

TEST(MapUsage, RefusesWhatIsNoRecordOfUse) {
  EXPECT_THAT(refusalOfUsage(""), HasSubstr("line 1: must be 'stamp_ns,poses,landmarks'"));
  EXPECT_THAT(refusalOfUsage("stamp_ns,poses,landmarks\n1,2\n"), "accepted");
  EXPECT_THAT(refusalOfUsage("stamp_ns,poses,landmarks\nx,2,\n"), HasSubstr("line 2: 'x'"));
  EXPECT_THAT(refusalOfUsage("stamp_ns,poses,landmarks\n1,-2,\n"), HasSubstr("line 2: '-2'"));
  EXPECT_THAT(refusalOfUsage("stamp_ns,poses,landmarks\n1,2,3\n"), HasSubstr("line 2: ''"));
  EXPECT_THAT(refusalOfUsage("stamp_ns,poses,landmarks\n1,2,3:4\n1,2,\n"),
              AllOf(HasSubstr("line 3"), HasSubstr("before")));
  EXPECT_THAT(refusalOfUsage("stamp_ns,poses,landmarks\n99999999999999999999,2,\n"), HasSubstr("line 2"));
}

TEST(MapSummary, KeepsWhatWasUsedMostButOneImageOfEachSession) {
  const TrainingMap map = onOneSpot(10);
  MapUsage usage;
  for (int k = 0; k < 3; ++k) usage.add(map, matched(4, {1}));
  for (int k = 0; k < 2; ++k) usage.add(map, matched(8, {1}));
  usage.add(map, matched(2, {1}));
  SummaryConfig config;
  config.images_per_place = 3;
  // Session 1 has odd numbers and was never used: its first image stays.
  EXPECT_EQ(summary(map, usage, config),
            (std::vector<bool>{false, true, false, false, true, false, false, false, true, false}));
  config.images_per_place = 1;
  EXPECT_EQ(summary(map, usage, config),
            (std::vector<bool>{false, true, false, false, true, false, false, false, false, false}));
}

TEST(MapSummary, APlaceThatWasNotUsedKeepsAllIfAskedTo) {
  auto images = test::exampleImages(12);
  for (std::size_t i = 0; i < images.size(); ++i) {
    images[i].position_m = {i < 6 ? 1.0 : 101.0, 1.0};
    images[i].yaw_rad = 0.0;
    images[i].session = 0;
  }
  const TrainingMap map(test::exampleHeader(), images);
  MapUsage usage;
  usage.add(map, matched(2, {1}));
  SummaryConfig config;
  config.images_per_place = 1;
  std::vector<bool> used_alone(12, false);
  used_alone[2] = used_alone[6] = true;
  EXPECT_EQ(summary(map, usage, config), used_alone);
  config.unused_places = false;
  std::fill(used_alone.begin() + 6, used_alone.end(), true);
  EXPECT_EQ(summary(map, usage, config), used_alone);
}

TEST(MapSummary, PlacesThatLookAnotherWayAreOthers) {
  auto images = test::exampleImages(8);
  for (std::size_t i = 0; i < images.size(); ++i) {
    images[i].position_m = {1.0, 1.0};
    images[i].session = 0;
    images[i].yaw_rad = 1.5707963 * static_cast<double>(i);
  }
  const TrainingMap map(test::exampleHeader(), images);
  SummaryConfig config;
  config.images_per_place = 1;
  const std::vector<bool> keep = summary(map, {}, config);
  EXPECT_EQ(std::count(keep.begin(), keep.end(), true), 4);
}

TEST(MapSummary, DropsLandmarksThatWereNeverUsed) {
  const TrainingMap map(test::exampleHeader(), test::exampleImages(6, 40));
  MapUsage usage;
  usage.add(map, matched(2, {7, 3, 21}));
  SummaryConfig config;
  config.landmarks_per_image = 2;
  TrainingImage image = map.image(2);
  dropUnusedLandmarks(image, usage, config);
  ASSERT_EQ(image.geometry->landmarks.size(), 3U);
  EXPECT_EQ(image.geometry->landmarks[0].feature, 3U);
  EXPECT_EQ(image.geometry->landmarks[1].feature, 7U);
  EXPECT_EQ(image.geometry->landmarks[2].feature, 21U);
  config.landmarks_per_image = 5;
  image = map.image(2);
  dropUnusedLandmarks(image, usage, config);
  EXPECT_EQ(image.geometry->landmarks.size(), 5U);
  TrainingImage never = map.image(4);
  dropUnusedLandmarks(never, usage, config);
  EXPECT_EQ(never.geometry->landmarks.size(), map.image(4).geometry->landmarks.size());
}

}  // namespace
}  // namespace visual_localization

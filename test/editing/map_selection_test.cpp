#include "editing/map_selection.h"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/support/example_map.h"
#include "test/support/temporary_folder.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

class MapSelection : public testing::Test {
 protected:
  test::TemporaryFolder folder_;
  std::string path_ = folder_ / "some.map";
  TrainingMap map_{test::exampleHeader(), test::exampleImages(12)};
};

TEST_F(MapSelection, KeepsWhatIsChosenToTheLastBit) {
  std::vector<bool> keep(map_.size(), false);
  for (const std::size_t i : {1, 4, 5, 8, 11}) keep[i] = true;
  writeSelection(map_, keep, "chosen", path_);
  checkMap(path_);
  const auto some = loadMap(path_);
  ASSERT_EQ(some->size(), 5U);
  std::size_t k = 0;
  for (const std::size_t i : {1, 4, 5, 8, 11}) {
    EXPECT_EQ(some->pose(k).stamp_ns, map_.pose(i).stamp_ns);
    EXPECT_EQ(some->pose(k).session, map_.pose(i).session);
    EXPECT_EQ(some->position_m(k), map_.position_m(i));
    EXPECT_EQ(some->local(k)->bytes(), map_.local(i)->bytes());
    ASSERT_TRUE(some->header().vocabulary);
    EXPECT_EQ(*some->vlad(k), some->header().vocabulary->describe(*map_.local(i)));
    EXPECT_TRUE(test::same(some->image(k).geometry, map_.image(i).geometry));
    ++k;
  }
  EXPECT_EQ(some->header().sessions.size(), 2U);
  EXPECT_EQ(some->header().datum.latitude_deg, map_.header().datum.latitude_deg);
  EXPECT_THAT(some->header().history, ElementsAre("chosen"));
}

TEST_F(MapSelection, ASessionThatHasNoImageLeftGoes) {
  writeSelection(map_, withoutSession(map_, "monday"), "removed", path_);
  const auto rest = loadMap(path_);
  ASSERT_EQ(rest->size(), 6U);
  ASSERT_EQ(rest->header().sessions.size(), 1U);
  EXPECT_EQ(rest->header().sessions[0].name, test::exampleHeader().sessions[1].name);
  for (std::size_t i = 0; i < rest->size(); ++i) EXPECT_EQ(rest->pose(i).session, 0);
}

TEST_F(MapSelection, TheHistoryGrows) {
  writeSelection(map_, std::vector<bool>(map_.size(), true), "first", path_);
  writeSelection(*loadMap(path_), std::vector<bool>(map_.size(), true), "second", folder_ / "again.map");
  EXPECT_THAT(loadMap(folder_ / "again.map")->header().history, ElementsAre("first", "second"));
}

TEST_F(MapSelection, RefusesAnUnknownSessionAndAnEmptyMap) {
  EXPECT_THAT([&] { withoutSession(map_, "sunday"); },
              testing::ThrowsMessage<MapEditError>(AllOf(HasSubstr("'sunday'"), HasSubstr("'monday'"))));
  EXPECT_THAT([&] { writeSelection(map_, std::vector<bool>(map_.size(), false), "", path_); },
              testing::ThrowsMessage<MapEditError>(HasSubstr("no image would be left")));
  EXPECT_FALSE(std::filesystem::exists(path_));
}

TEST_F(MapSelection, SpacedLeavesOutWhatIsCloseInEachSession) {
  const std::vector<bool> keep = spaced(map_, 7.0);
  for (int session = 0; session < 2; ++session) {
    std::size_t last = map_.size();
    std::size_t kept = 0;
    for (std::size_t i = 0; i < map_.size(); ++i) {
      if (map_.pose(i).session != session) continue;
      const double way_m = last == map_.size() ? 1e9 : (map_.position_m(i) - map_.position_m(last)).norm();
      EXPECT_EQ(keep[i], way_m >= 7.0) << i;
      if (!keep[i]) continue;
      last = i;
      ++kept;
    }
    EXPECT_GT(kept, 1U);
    EXPECT_LT(kept, 6U);
  }
}

}  // namespace
}  // namespace visual_localization

// A map whose file is damaged, cut, replaced or overwritten while it is in use: what comes out is right or nothing.

#include <filesystem>
#include <fstream>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "map/map_schema.h"
#include "test/map/large_map.h"
#include "test/map/stored_geometry.h"

namespace visual_localization {
namespace {

using test::kImages;
using test::LargeMap;
using test::same;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

TEST_F(LargeMap, DamagedFeaturesCountAsNoneAndAreNamedOnce) {
  tamper("UPDATE features SET descriptors = zeroblob(6400) WHERE image = 3");
  tamper("UPDATE features SET crc32 = 'text' WHERE image = 4");
  tamper("DELETE FROM features WHERE image = 5");
  tamper("UPDATE globals SET wgoh = x'00' WHERE image = 6");
  tamper("UPDATE previews SET jpeg = x'00' WHERE image = 7");
  tamper("UPDATE landmarks SET points = zeroblob(500) WHERE image = 8");
  const auto map = open();
  for (int round = 0; round < 2; ++round) {
    for (const std::size_t i : {3U, 4U, 5U}) EXPECT_TRUE(map->local(i)->empty()) << i;
    EXPECT_EQ(map->global(6)->wgoh, GlobalFeatures().wgoh);
    EXPECT_TRUE(map->preview(7).empty());
    EXPECT_EQ(map->geometry(8), nullptr);
    EXPECT_FALSE(map->image(4).geometry) << "its features are gone";
    EXPECT_TRUE(same(map->image(10), images_[10]));
  }
  ASSERT_EQ(warnings_.size(), 1U);
  EXPECT_THAT(warnings_.front(), AllOf(StartsWith(path_), HasSubstr("features of image 3"), HasSubstr("checksum")));
  EXPECT_THROW(checkMap(path_), MapStoreError);
  EXPECT_THROW(open(std::numeric_limits<std::size_t>::max()), MapStoreError) << "read as a whole it is refused";
}

TEST_F(LargeMap, DamagedLandmarksCountAsNoneAndAreNamedOnce) {
  tamper("UPDATE landmarks SET points = zeroblob(500) WHERE image = 4");
  tamper("UPDATE landmarks SET pose = x'00' WHERE image = 5");
  const auto map = open();
  EXPECT_EQ(map->geometryCount(), 40U);
  for (int round = 0; round < 2; ++round) {
    EXPECT_EQ(map->geometry(3), nullptr) << "it has none";
    EXPECT_EQ(warnings_.size(), static_cast<std::size_t>(round));
    EXPECT_EQ(map->geometry(4), nullptr);
    EXPECT_EQ(map->geometry(5), nullptr);
    EXPECT_EQ(map->local(4)->bytes(), images_[4].local.bytes());
    EXPECT_TRUE(same(map->image(7), images_[7]));
  }
  ASSERT_EQ(warnings_.size(), 1U);
  EXPECT_THAT(warnings_.front(), AllOf(StartsWith(path_), HasSubstr("landmarks of image 4"), HasSubstr("checksum")));
  EXPECT_THROW(checkMap(path_), MapStoreError);
}

TEST_F(LargeMap, AnImageWithOtherThanItsPlacesNumberOfFeaturesCountsAsDamaged) {
  std::vector<TrainingImage> others = images_;
  std::mt19937 random(9);
  for (const std::size_t i : {3U, 4U}) others[i].local = test::randomFeatures(51, random);
  const std::string other_path = folder_ / "other.map";
  saveMap(TrainingMap(test::exampleHeader(), others), other_path);
  tamper("ATTACH '" + other_path +
         "' AS other; DELETE FROM main.features WHERE image IN (3, 4); "
         "INSERT INTO main.features SELECT * FROM other.features WHERE image IN (3, 4)");
  // With checksums that are right.
  const TrainingPoses poses = posesOf(images_);
  for (const std::size_t i : {3U, 4U}) {
    const std::vector<std::uint8_t> keypoints = map_schema::packKeypoints(others[i].local.keypoints());
    const std::int64_t crc32 =
        map_schema::rowChecksum(map_schema::rowSeed(map_schema::rowOf(poses, i)),
                                {test::bytesOf(keypoints), test::bytesOf(others[i].local.bytes())});
    tamper("UPDATE features SET crc32 = " + std::to_string(crc32) + " WHERE image = " + std::to_string(i));
  }
  const auto map = open();
  EXPECT_TRUE(map->local(3)->empty());
  EXPECT_TRUE(map->local(4)->empty());
  EXPECT_TRUE(same(map->image(5), images_[5]));
  ASSERT_EQ(warnings_.size(), 1U);
  EXPECT_THAT(warnings_.front(), AllOf(HasSubstr("image 3"), HasSubstr("51 features instead of 50")));
  EXPECT_THROW(checkMap(path_), MapStoreError);
}

TEST_F(LargeMap, ExchangedImagesAreNotTakenForEachOther) {
  tamper(
      "UPDATE features SET image = -1 WHERE image = 3; UPDATE features SET image = 3 WHERE image = 4; "
      "UPDATE features SET image = 4 WHERE image = -1");
  const auto map = open();
  EXPECT_TRUE(map->local(3)->empty());
  EXPECT_TRUE(map->local(4)->empty());
}

TEST_F(LargeMap, SurvivesItsFileBeingDeletedOrReplaced) {
  const auto map = open();
  std::filesystem::remove(path_);
  expectAllSame(*map);
  saveMap(TrainingMap(test::exampleHeader(), test::exampleImages(5, 3, 9)), path_);
  expectAllSame(*map);
  EXPECT_THAT(warnings_, ElementsAre());
}

/// As `cp other.map live.map` does: rows that are whole, but of another map.
TEST_F(LargeMap, TakesNothingFromAnotherMapThatWasCopiedOverIt) {
  std::vector<TrainingImage> others = test::exampleImages(kImages, 50, 9);
  for (std::size_t i = 0; i < others.size(); ++i) {
    others[i].position_m.x() += 1e-3;  // the same recording, built again with other parameters
    others[i].geometry = images_[i].geometry;
  }
  const auto map = open(0);
  saveMap(TrainingMap(test::exampleHeader(), others), folder_ / "other.map");
  const std::string other = test::readAll(folder_ / "other.map");
  ASSERT_EQ(other.size(), test::readAll(path_).size());
  std::ofstream(path_, std::ios::binary | std::ios::in) << other;  // in place, so that the open file sees it
  for (std::size_t i = 0; i < kImages; ++i) {
    EXPECT_TRUE(map->local(i)->empty()) << i;
    EXPECT_EQ(map->global(i)->wgoh, GlobalFeatures().wgoh) << i;
    EXPECT_TRUE(map->preview(i).empty()) << i;
    EXPECT_EQ(map->geometry(i), nullptr) << i;
  }
  EXPECT_THAT(warnings_, ElementsAre(AllOf(HasSubstr("features of image 0"), HasSubstr("checksum"))));
}

TEST_F(LargeMap, SurvivesItsFileBeingCutAtAnyLength) {
  const std::string whole = test::readAll(path_);
  for (std::size_t length = 0; length < whole.size(); length += 1 + whole.size() / 60) {
    test::writeAll(path_, whole);
    warnings_.clear();
    const auto map = open();
    map->local(7);
    std::filesystem::resize_file(path_, length);
    expectRightOrNothing(*map);
    EXPECT_EQ(warnings_.size(), 1U) << length;
  }
}

TEST_F(LargeMap, SurvivesItsFileBeingOverwritten) {
  const std::string whole = test::readAll(path_);
  std::mt19937 random(3);
  std::uniform_int_distribution<std::size_t> place(0, whole.size() - 1);
  for (int round = 0; round < 60; ++round) {
    test::writeAll(path_, whole);
    const auto map = open(0);
    std::string damaged = whole;
    for (int flip = 0; flip < 200; ++flip) damaged[place(random)] = static_cast<char>(random());
    // In place, so that the open file sees it.
    std::ofstream(path_, std::ios::binary | std::ios::in) << damaged;
    expectRightOrNothing(*map);
  }
}

TEST_F(LargeMap, OpensWithoutReadingFeatures) {
  std::string damaged = test::readAll(path_);
  const std::vector<std::uint8_t>& bytes = images_[20].local.bytes();
  const std::size_t at = damaged.find(std::string(bytes.begin(), bytes.begin() + 64));
  ASSERT_NE(at, std::string::npos);
  damaged[at + 32] ^= 1;
  test::writeAll(path_, damaged);
  const auto map = open();
  EXPECT_THAT(warnings_, ElementsAre());
  EXPECT_TRUE(map->local(20)->empty());
  EXPECT_THAT(warnings_, ElementsAre(HasSubstr("image 20")));
}

TEST_F(LargeMap, RefusesDamagedPlacesAtOnce) {
  const std::string whole = test::readAll(path_);
  for (const char* sql : {"UPDATE images SET east_m = east_m + 1 WHERE id = 3", "DELETE FROM images WHERE id = 3",
                          "UPDATE images SET feature_count = feature_count + 1 WHERE id = 3",
                          "UPDATE images SET id = 9223372036854775807 WHERE id = 59", "DELETE FROM images",
                          "UPDATE images SET stamp_ns = 1.5 WHERE id = 3"}) {
    test::writeAll(path_, whole);
    tamper(sql);
    EXPECT_THROW(open(), MapStoreError) << sql;
  }
}

}  // namespace
}  // namespace visual_localization

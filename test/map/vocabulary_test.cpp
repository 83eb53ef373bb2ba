// The vocabulary of a map and the VLAD of its images: stored, read in either way, checked.

#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "map/map_writer.h"
#include "test/map/stored_map.h"

namespace visual_localization {
namespace {

using test::describedMap;
using test::exampleHeader;
using test::MapStore;
using testing::HasSubstr;

class VocabularyStore : public MapStore {
 protected:
  void SetUp() override { saveMap(map_, path_); }

  std::shared_ptr<const TrainingMap> openLazily() {
    return loadMap(path_, {0, [this](const std::string& reason) { warnings_.push_back(reason); }});
  }

  TrainingMap map_ = describedMap();
  std::vector<std::string> warnings_;
};

TEST_F(VocabularyStore, ComesBackToTheLastBit) {
  EXPECT_NO_THROW(checkMap(path_));
  for (const auto& read : {loadMap(path_), openLazily()}) {
    ASSERT_TRUE(read->header().vocabulary);
    EXPECT_EQ(read->header().vocabulary->bytes(), 12U);
    for (std::size_t i = 0; i < map_.size(); ++i) {
      EXPECT_EQ(*read->vlad(i), *map_.vlad(i));
      EXPECT_EQ(read->header().vocabulary->describe(*map_.local(i)), *map_.vlad(i));
      EXPECT_EQ(read->image(i).vlad, *map_.vlad(i));
    }
  }
  EXPECT_TRUE(warnings_.empty());
}

TEST_F(VocabularyStore, ADamagedVladIsRefusedOrLeftOut) {
  tamper("UPDATE vlads SET descriptor = (SELECT descriptor FROM vlads WHERE image = 5) WHERE image = 4");
  EXPECT_THAT(refusal(path_), HasSubstr("VLAD of image 4 do not agree with their checksum"));
  EXPECT_THROW(checkMap(path_), MapStoreError);
  const auto read = openLazily();
  EXPECT_EQ(*read->vlad(3), *map_.vlad(3));
  EXPECT_TRUE(read->vlad(4)->empty());
  ASSERT_EQ(warnings_.size(), 1U);
  EXPECT_THAT(warnings_.front(), HasSubstr("VLAD of image 4"));
}

TEST_F(VocabularyStore, WhatIsMissingSurplusOrChangedIsRefused) {
  const std::vector<std::pair<const char*, const char*>> changes{
      {"DELETE FROM vlads WHERE image = 7", "VLAD of image 7 are missing"},
      {"INSERT INTO vlads VALUES(24, x'00', 0)", "VLAD without an image"},
      {"UPDATE vocabulary SET learnt = CAST(learnt || x'00' AS BLOB)", "vocabulary does not agree with its checksum"},
      {"DELETE FROM vocabulary", "vocabulary is missing"},
      {"INSERT INTO vocabulary SELECT 1, learnt FROM vocabulary", "its vocabulary is not one"},
      {"DELETE FROM meta WHERE key = 'vocabulary'", "vocabulary is missing or unexpected"}};
  for (const auto& [change, expected] : changes) {
    saveMap(map_, path_);
    tamper(change);
    EXPECT_THAT(refusal(path_), HasSubstr(expected)) << change;
  }
}

TEST_F(VocabularyStore, TablesOfAnotherSizeAreRefused) {
  const std::vector<std::uint8_t> packed = map_schema::packVocabulary(*map_.header().vocabulary);
  const auto unpack = [&](std::size_t size, std::size_t dimension) {
    return map_schema::unpackVocabulary({packed.data(), size}, dimension, {320, 240});
  };
  EXPECT_NO_THROW(unpack(packed.size(), kSiftDimension));
  EXPECT_THROW(unpack(packed.size() - 1, kSiftDimension), std::runtime_error);
  EXPECT_THROW(unpack(packed.size(), 64), std::runtime_error);
  EXPECT_THROW(unpack(3, kSiftDimension), std::runtime_error);
}

TEST_F(VocabularyStore, AMapTakesOnlyVladOfItsVocabulary) {
  std::vector<TrainingImage> images;
  for (std::size_t i = 0; i < map_.size(); ++i) images.push_back(map_.image(i));
  EXPECT_THROW(TrainingMap(exampleHeader(), images), std::invalid_argument);
  MapWriter writer(folder_ / "other.map", exampleHeader().kind);
  for (const TrainingImage& image : images) writer.append(image);
  EXPECT_THROW(writer.finish(exampleHeader()), MapStoreError);
  images[3].vlad.pop_back();
  EXPECT_THROW(TrainingMap(map_.header(), images), std::invalid_argument);
}

}  // namespace
}  // namespace visual_localization

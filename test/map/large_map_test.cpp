// A map that is larger than its cache: the same features, whatever is kept.

#include "test/map/large_map.h"

#include <atomic>
#include <limits>
#include <random>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "map/map_writer.h"

namespace visual_localization {
namespace {

using test::kImages;
using test::kKilobyte;
using test::LargeMap;
using testing::ElementsAre;

TEST_F(LargeMap, EveryCacheGivesTheSameFeaturesAgainAndAgain) {
  for (const std::size_t cache : {std::size_t{0}, std::size_t{1}, 10 * kKilobyte, 40 * kKilobyte, 300 * kKilobyte,
                                  std::numeric_limits<std::size_t>::max()}) {
    const auto map = open(cache);
    for (int round = 0; round < 3; ++round) expectAllSame(*map);
  }
  EXPECT_THAT(warnings_, ElementsAre());
}

TEST_F(LargeMap, WhatIsInUseOutlivesTheCache) {
  const auto map = open(20 * kKilobyte);
  const auto used = map->local(7);
  expectAllSame(*map);
  EXPECT_EQ(used->bytes(), images_[7].local.bytes());
}

TEST_F(LargeMap, ServesEightThreads) {
  const auto map = open(60 * kKilobyte);
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (unsigned seed = 0; seed < 8; ++seed) {
    threads.emplace_back([&, seed] {
      std::mt19937 random(seed);
      std::uniform_int_distribution<std::size_t> any(0, kImages - 1);
      for (int round = 0; round < 300; ++round) {
        const std::size_t i = any(random);
        if (map->local(i)->bytes() != images_[i].local.bytes()) ++wrong;
        if (map->global(i)->wgii != images_[i].global.wgii) ++wrong;
        if (const auto geometry = map->geometry(i); (geometry != nullptr) != images_[i].geometry.has_value() ||
                                                    (geometry && !test::same(*geometry, images_[i].geometry))) {
          ++wrong;
        }
        if (round % 16 == 0 && map->preview(i) != images_[i].preview_jpeg) ++wrong;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

TEST_F(LargeMap, LandmarksShareTheCache) {
  const auto map = open(20 * kKilobyte);
  const auto used = map->geometry(7);
  EXPECT_EQ(map->geometry(7), used) << "kept";
  expectAllSame(*map);
  EXPECT_NE(map->geometry(7), used) << "no longer kept";
  EXPECT_TRUE(test::same(*used, images_[7].geometry)) << "but still in use";
  EXPECT_NE(open(0)->geometry(7), nullptr);
}

TEST_F(LargeMap, AWriterWithoutFinishLeavesNothing) {
  {
    MapWriter writer(folder_ / "other.map");
    for (const TrainingImage& image : images_) writer.append(image);
    EXPECT_EQ(folder_.names().size(), 2U);
  }
  EXPECT_EQ(folder_.names().size(), 1U);
}

TEST_F(LargeMap, AWriterWritesWhatSaveMapWrites) {
  MapWriter writer(folder_ / "other.map");
  for (const TrainingImage& image : images_) writer.append(image);
  writer.finish(test::exampleHeader());
  EXPECT_EQ(test::readAll(folder_ / "other.map"), test::readAll(path_));
  const auto map = open();
  saveMap(*map, folder_ / "copy.map");
  EXPECT_EQ(test::readAll(folder_ / "copy.map"), test::readAll(path_));
}

}  // namespace
}  // namespace visual_localization

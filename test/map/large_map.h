#pragma once

#include <cstring>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "test/support/example_map.h"
#include "test/support/tamper.h"
#include "test/support/temporary_folder.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization::test {

inline constexpr std::size_t kImages = 60;
inline constexpr std::size_t kKilobyte = 1024;

inline bool same(const TrainingImage& a, const TrainingImage& b) {
  return a.stamp_ns == b.stamp_ns && a.session == b.session && a.position_m == b.position_m && a.yaw_rad == b.yaw_rad &&
         a.local.bytes() == b.local.bytes() && a.local.keypoints() == b.local.keypoints() &&
         a.global.wgoh == b.global.wgoh && a.global.wgii == b.global.wgii && a.preview_jpeg == b.preview_jpeg &&
         test::same(a.geometry, b.geometry);
}

class LargeMap : public testing::Test {
 protected:
  void SetUp() override {
    images_ = test::exampleImages(kImages, 50);
    std::mt19937 random(5);
    std::uniform_real_distribution<float> value(0.0F, 1.0F);
    for (TrainingImage& image : images_) {
      for (float& bin : image.global.wgoh) bin = value(random);
      for (float& bin : image.global.wgii) bin = value(random);
    }
    saveMap(TrainingMap(test::exampleHeader(), images_), path_);
  }

  std::shared_ptr<const TrainingMap> open(std::size_t cache_bytes = 40 * kKilobyte) {
    return loadMap(path_, {cache_bytes, [this](const std::string& reason) { warnings_.push_back(reason); }});
  }

  void expectAllSame(const TrainingMap& map) const {
    ASSERT_EQ(map.size(), images_.size());
    for (std::size_t i = 0; i < images_.size(); ++i) {
      EXPECT_TRUE(same(map.image(i), images_[i])) << i;
      EXPECT_EQ(map.featureCount(i), images_[i].local.size());
    }
  }

  void tamper(const std::string& sql) const { test::tamper(path_, sql); }

  /// Uses everything in the map; what comes out is either right or nothing.
  void expectRightOrNothing(const TrainingMap& map) const {
    for (std::size_t i = 0; i < images_.size(); ++i) {
      const auto sift = map.local(i);
      const auto global = map.global(i);
      EXPECT_TRUE(sift->empty() || sift->bytes() == images_[i].local.bytes()) << i;
      EXPECT_TRUE(global->wgoh == GlobalFeatures().wgoh || global->wgoh == images_[i].global.wgoh) << i;
      map.preview(i);
      const auto geometry = map.geometry(i);
      EXPECT_TRUE(!geometry || test::same(*geometry, images_[i].geometry)) << i;
    }
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_ / "large.map";
  std::vector<TrainingImage> images_;
  std::vector<std::string> warnings_;
};

}  // namespace visual_localization::test

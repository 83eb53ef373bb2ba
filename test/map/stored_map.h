#pragma once

#include <cstring>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "test/support/example_map.h"
#include "test/support/tamper.h"
#include "test/support/temporary_folder.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization::test {

inline TrainingMap exampleMap(std::size_t images = 12, std::size_t features = 20, unsigned seed = 1) {
  return {exampleHeader(), exampleImages(images, features, seed)};
}

inline void expectSame(const std::optional<SensorMount>& a, const std::optional<SensorMount>& b) {
  ASSERT_EQ(a.has_value(), b.has_value());
  if (!a) return;
  EXPECT_EQ(a->camera.position_m, b->camera.position_m);
  EXPECT_LT(a->camera.rotation.angularDistance(b->camera.rotation), 1e-12);
  EXPECT_EQ(a->antenna_m, b->antenna_m);
}

inline void expectSame(const MapHeader& a, const MapHeader& b) {
  EXPECT_EQ(a.datum.latitude_deg, b.datum.latitude_deg);
  EXPECT_EQ(a.datum.longitude_deg, b.datum.longitude_deg);
  EXPECT_EQ(a.datum.altitude_m, b.datum.altitude_m);
  EXPECT_EQ(a.image_size, b.image_size);
  EXPECT_EQ(a.kind->name(), b.kind->name());
  EXPECT_EQ(a.kind->parameters(), b.kind->parameters());
  ASSERT_EQ(a.sessions.size(), b.sessions.size());
  for (std::size_t s = 0; s < a.sessions.size(); ++s) {
    EXPECT_EQ(a.sessions[s].name, b.sessions[s].name);
    EXPECT_EQ(a.sessions[s].camera, b.sessions[s].camera);
    EXPECT_TRUE(a.sessions[s].mask == b.sessions[s].mask);
    expectSame(a.sessions[s].mount, b.sessions[s].mount);
  }
}

inline void expectSame(const TrainingImage& a, const TrainingImage& b) {
  EXPECT_EQ(a.stamp_ns, b.stamp_ns);
  EXPECT_EQ(a.session, b.session);
  EXPECT_EQ(a.position_m, b.position_m);
  EXPECT_EQ(a.yaw_rad, b.yaw_rad);
  EXPECT_EQ(a.preview_jpeg, b.preview_jpeg);
  EXPECT_TRUE(same(a.geometry, b.geometry));
  EXPECT_EQ(a.global.wgoh, b.global.wgoh);
  EXPECT_EQ(a.global.wgii, b.global.wgii);
  EXPECT_EQ(a.local.bytes(), b.local.bytes());
  ASSERT_EQ(a.local.size(), b.local.size());
  if (a.local.empty()) return;
  EXPECT_TRUE(a.local.keypoints() == b.local.keypoints());
}

/// Bit by bit, but for the sign of a zero.
inline void expectSame(const TrainingMap& a, const TrainingMap& b) {
  expectSame(a.header(), b.header());
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(a.geometryCount(), b.geometryCount());
  for (std::size_t i = 0; i < a.size(); ++i) {
    SCOPED_TRACE("image " + std::to_string(i));
    expectSame(a.image(i), b.image(i));
  }
}

/// A map in a file, which may be changed and is read again.
class MapStore : public testing::Test {
 protected:
  void SetUp() override { saveMap(exampleMap(), path_); }

  /// The one-line reason why the file is refused; empty when it is not.
  static std::string refusal(const std::string& path) {
    try {
      loadMap(path);
      return {};
    } catch (const MapStoreError& error) {
      const std::string text = error.what();
      EXPECT_EQ(text.find('\n'), std::string::npos) << text;
      EXPECT_EQ(text.rfind(path, 0), 0U) << text;
      return text;
    }
  }

  void tamper(const std::string& sql) const { test::tamper(path_, sql); }

  TemporaryFolder folder_;
  std::string path_ = folder_ / "a map?#%20.map";
};

}  // namespace visual_localization::test

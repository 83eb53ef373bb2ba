// What a map file says about the camera of an image and its landmarks: there and back, and refused where it cannot be.

#include <cmath>
#include <cstring>
#include <functional>
#include <iomanip>
#include <limits>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "map/little_endian.h"
#include "map/map_schema.h"
#include "map/map_writer.h"
#include "map/packed_geometry.h"
#include "test/support/example_map.h"
#include "test/support/tamper.h"
#include "test/support/temporary_folder.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization {
namespace {

using map_schema::PackedGeometry;
using map_schema::packGeometry;
using testing::HasSubstr;

constexpr std::size_t kFeatures = 20;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

sqlite::Bytes bytesOf(const std::vector<std::uint8_t>& bytes) { return {bytes.data(), bytes.size()}; }

ImageGeometry unpacked(const PackedGeometry& packed, std::size_t features) {
  return map_schema::unpackGeometry(bytesOf(packed.pose), bytesOf(packed.points), features);
}

TEST(PackedGeometry, ComesBackToTheLastBit) {
  const ImageGeometry geometry = test::exampleGeometry(kFeatures);
  const PackedGeometry packed = packGeometry(geometry, kFeatures);
  EXPECT_EQ(packed.pose.size(), 140U);
  EXPECT_EQ(packed.points.size(), 20U * kFeatures / 2);
  EXPECT_TRUE(test::same(unpacked(packed, kFeatures), geometry));
}

TEST(PackedGeometry, ManyFeaturesNeedLongerIndices) {
  ImageGeometry geometry = test::exampleGeometry(4);
  geometry.landmarks.back().feature = 65535;
  EXPECT_EQ(packGeometry(geometry, 65536).points.size(), 2U * 20U);
  EXPECT_TRUE(test::same(unpacked(packGeometry(geometry, 65536), 65536), geometry));
  geometry.landmarks.back().feature = 65536;
  EXPECT_EQ(packGeometry(geometry, 65537).points.size(), 2U * 22U);
  EXPECT_TRUE(test::same(unpacked(packGeometry(geometry, 65537), 65537), geometry));
}

TEST(PackedGeometry, NeedsNoLandmarks) {
  const ImageGeometry geometry = test::exampleGeometry(0);
  EXPECT_TRUE(test::same(unpacked(packGeometry(geometry, 0), 0), geometry));
}

TEST(PackedGeometry, ASingularCovarianceOfAnyScaleSurvivesRounding) {
  Eigen::Matrix<double, 6, 1> axis;
  axis << 1e3, 1.0 / 3.0, -1e-2, 1e-7, 0.0, 1e-9;
  ImageGeometry geometry = test::exampleGeometry(4);
  geometry.covariance = axis * axis.transpose();
  const ImageGeometry read = unpacked(packGeometry(geometry, 4), 4);
  EXPECT_TRUE(read.covariance.isApprox(geometry.covariance, 1e-7));
  EXPECT_EQ(read.covariance, read.covariance.transpose());
  EXPECT_NO_THROW(packGeometry(read, 4));
}

TEST(SigmaClass, KnownAnswers) {
  EXPECT_EQ(map_schema::sigmaClass(0.0F), 0);
  EXPECT_EQ(map_schema::sigmaClass(0.001F), 0);
  EXPECT_EQ(map_schema::sigmaClass(0.00101F), 1);
  EXPECT_EQ(map_schema::sigmaClass(1.0F), 142);  // ln 1000 / ln 1.05 = 141.6
  EXPECT_EQ(map_schema::sigmaClass(1e9F), 255);
  EXPECT_FLOAT_EQ(map_schema::sigmaOf(0), 0.001F);
  EXPECT_FLOAT_EQ(map_schema::sigmaOf(14), 0.0019799316F);
  EXPECT_NEAR(map_schema::sigmaOf(255), 253.0F, 1.0F);
}

TEST(SigmaClass, RoundsUpAndComesBack) {
  for (int i = 0; i < 256; ++i) {
    const auto of_class = static_cast<std::uint8_t>(i);
    EXPECT_EQ(map_schema::sigmaClass(map_schema::sigmaOf(of_class)), of_class);
  }
  for (float sigma_m = 0.001F; sigma_m < 250.0F; sigma_m *= 1.013F) {
    const float stored_m = map_schema::sigmaOf(map_schema::sigmaClass(sigma_m));
    EXPECT_GE(stored_m, sigma_m);
    EXPECT_LE(stored_m, 1.051F * sigma_m);
  }
}

/// A change of the example that makes it unusable, and what is said about that.
struct Unusable {
  std::function<void(ImageGeometry&)> change;
  std::string reason;
};

std::vector<Unusable> unusable() {
  const std::string covariance = "covariance of the camera's pose";
  return {{[](ImageGeometry& g) { g.camera.position_m.z() = kNan; }, "camera's position"},
          {[](ImageGeometry& g) { g.camera.position_m.x() = HUGE_VAL; }, "camera's position"},
          {[](ImageGeometry& g) { g.camera.position_m.y() = -1.0001e6; }, "camera's position"},
          {[](ImageGeometry& g) { g.camera.rotation.w() = kNan; }, "camera's rotation"},
          {[](ImageGeometry& g) { g.camera.rotation.coeffs() *= 1.001; }, "camera's rotation"},
          {[](ImageGeometry& g) { g.camera.rotation.coeffs().setZero(); }, "camera's rotation"},
          {[](ImageGeometry& g) { g.covariance(2, 2) = kNan; }, covariance},
          {[](ImageGeometry& g) { g.covariance(1, 4) = g.covariance(4, 1) = HUGE_VAL; }, covariance},
          {[](ImageGeometry& g) { g.covariance(3, 3) = -0.01; }, covariance},
          {[](ImageGeometry& g) { g.covariance(1, 4) = g.covariance(4, 1) = 0.5; }, covariance},
          {[](ImageGeometry& g) { g.covariance(0, 0) = 0.0; }, covariance},
          // Each pair is possible, the three together are not.
          {[](ImageGeometry& g) {
             g.covariance.setIdentity();
             g.covariance(0, 1) = g.covariance(1, 0) = 0.9;
             g.covariance(0, 2) = g.covariance(2, 0) = 0.9;
             g.covariance(1, 2) = g.covariance(2, 1) = -0.9;
           },
           covariance},
          {[](ImageGeometry& g) { g.landmarks[4].feature = kFeatures; }, "feature 20 of 20"},
          {[](ImageGeometry& g) { g.landmarks[4].feature = 65535; }, "feature 65535 of 20"},
          {[](ImageGeometry& g) { g.landmarks[4].feature = g.landmarks[3].feature; }, "not in order"},
          {[](ImageGeometry& g) { std::swap(g.landmarks[4], g.landmarks[3]); }, "not in order"},
          {[](ImageGeometry& g) { g.landmarks[4].offset_m.y() = kNan; }, "landmark's offset"},
          {[](ImageGeometry& g) { g.landmarks[4].offset_m.z() = -HUGE_VALF; }, "landmark's offset"},
          {[](ImageGeometry& g) {
             g.landmarks[4].offset_m = {8e4F, 8e4F, 0.0F};
           },
           "landmark's offset"},
          {[](ImageGeometry& g) { g.landmarks[4].offset_m.x() = 3e38F; }, "landmark's offset"}};
}

TEST(PackedGeometry, WhatCannotBeReadIsNotWritten) {
  std::vector<Unusable> cases = unusable();
  // These cannot be said in a file.
  cases.push_back({[](ImageGeometry& g) { g.covariance(0, 5) = 0.0; }, "covariance"});
  cases.push_back({[](ImageGeometry& g) { g.covariance(2, 2) = 1e39; }, "covariance"});
  cases.push_back({[](ImageGeometry& g) { g.landmarks[4].sigma_along_m = kNan; }, "standard deviation"});
  cases.push_back({[](ImageGeometry& g) { g.landmarks[4].sigma_across_m = HUGE_VALF; }, "standard deviation"});
  cases.push_back({[](ImageGeometry& g) { g.landmarks[4].sigma_along_m = -1e-6F; }, "standard deviation"});
  for (std::size_t i = 0; i < cases.size(); ++i) {
    ImageGeometry geometry = test::exampleGeometry(kFeatures);
    cases[i].change(geometry);
    try {
      packGeometry(geometry, kFeatures);
      ADD_FAILURE() << "accepted: case " << i;
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), HasSubstr(cases[i].reason)) << i;
    }
  }
}

/// Without asking whether that can be; kFeatures features.
PackedGeometry packedAsIs(const ImageGeometry& geometry) {
  PackedGeometry packed{std::vector<std::uint8_t>(140), std::vector<std::uint8_t>(20 * geometry.landmarks.size())};
  const CameraPose& camera = geometry.camera;
  for (Eigen::Index i = 0; i < 3; ++i) map_schema::putDouble(camera.position_m[i], &packed.pose[8 * i]);
  const double rotation[] = {camera.rotation.w(), camera.rotation.x(), camera.rotation.y(), camera.rotation.z()};
  for (std::size_t i = 0; i < 4; ++i) map_schema::putDouble(rotation[i], &packed.pose[24 + 8 * i]);
  std::uint8_t* to = &packed.pose[56];
  for (Eigen::Index row = 0; row < 6; ++row) {
    for (Eigen::Index column = row; column < 6; ++column, to += 4) {
      map_schema::putFloat(static_cast<float>(geometry.covariance(row, column)), to);
    }
  }
  to = packed.points.data();
  for (const SeenLandmark& landmark : geometry.landmarks) {
    map_schema::putLittleEndian(static_cast<std::uint16_t>(landmark.feature), to);
    map_schema::putLittleEndian(landmark.id, to + 2);
    for (Eigen::Index i = 0; i < 3; ++i) map_schema::putFloat(landmark.offset_m[i], to + 6 + 4 * i);
    to[18] = map_schema::sigmaClass(landmark.sigma_along_m);
    to[19] = map_schema::sigmaClass(landmark.sigma_across_m);
    to += 20;
  }
  return packed;
}

TEST(PackedGeometry, HasTheDocumentedForm) {
  const ImageGeometry geometry = test::exampleGeometry(kFeatures);
  EXPECT_EQ(packGeometry(geometry, kFeatures).pose, packedAsIs(geometry).pose);
  EXPECT_EQ(packGeometry(geometry, kFeatures).points, packedAsIs(geometry).points);
}

std::string blob(const std::vector<std::uint8_t>& bytes) {
  std::ostringstream text;
  text << "x'" << std::hex << std::setfill('0');
  for (const std::uint8_t byte : bytes) text << std::setw(2) << int{byte};
  return text.str() + "'";
}

class Landmarks : public testing::Test {
 protected:
  void SetUp() override { restore(); }

  void restore() const { saveMap({test::exampleHeader(), test::exampleImages(6, kFeatures)}, path_); }

  void tamper(const std::string& sql) const { test::tamper(path_, sql); }

  /// Replaces the row of an image by one whose checksum is right.
  void put(std::int64_t image, const PackedGeometry& packed) const {
    restore();
    const std::int64_t crc32 = map_schema::rowChecksum(image, {bytesOf(packed.pose), bytesOf(packed.points)});
    tamper("REPLACE INTO landmarks VALUES(" + std::to_string(image) + ", " + blob(packed.pose) + ", " +
           blob(packed.points) + ", " + std::to_string(crc32) + ")");
  }

  /// Read as a whole, read by --check.
  void expectRefused(const std::string& reason) const {
    for (const auto& read :
         std::vector<std::function<void()>>{[this] { loadMap(path_); }, [this] { checkMap(path_); }}) {
      try {
        read();
        ADD_FAILURE() << "accepted instead of: " << reason;
      } catch (const MapStoreError& error) {
        EXPECT_THAT(error.what(), HasSubstr(reason));
      }
    }
  }

  /// Read when it is needed, an image counts as one without geometry.
  void expectNone(std::size_t image, const std::string& reason) const {
    std::string warning;
    const auto map = loadMap(path_, {0, [&warning](const std::string& line) { warning = line; }});
    EXPECT_EQ(map->geometry(image), nullptr) << reason;
    EXPECT_THAT(warning, HasSubstr(reason));
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_ / "a.map";
};

TEST_F(Landmarks, AreKnownWithoutReadingThem) {
  for (const std::size_t cache : {std::size_t{0}, std::numeric_limits<std::size_t>::max()}) {
    const auto map = loadMap(path_, {cache});
    EXPECT_TRUE(map->hasGeometry());
    EXPECT_EQ(map->geometryCount(), 4U);
  }
}

TEST_F(Landmarks, AMapWithoutAnySaysSo) {
  std::vector<TrainingImage> images = test::exampleImages(6, kFeatures);
  for (TrainingImage& image : images) image.geometry.reset();
  saveMap({test::exampleHeader(), images}, path_);
  for (const std::size_t cache : {std::size_t{0}, std::numeric_limits<std::size_t>::max()}) {
    const auto map = loadMap(path_, {cache, [](const std::string& line) { FAIL() << line; }});
    EXPECT_FALSE(map->hasGeometry());
    EXPECT_EQ(map->geometry(1), nullptr);
  }
  EXPECT_NO_THROW(checkMap(path_));
}

TEST_F(Landmarks, AGoodRowIsAccepted) {
  const ImageGeometry geometry = test::exampleGeometry(kFeatures, 99);
  put(4, packedAsIs(geometry));
  EXPECT_NO_THROW(checkMap(path_));
  EXPECT_TRUE(test::same(*loadMap(path_)->geometry(4), geometry));
  EXPECT_TRUE(test::same(*loadMap(path_, {0})->geometry(4), geometry));
}

TEST_F(Landmarks, UnusableOnesAreRefused) {
  for (const auto& [change, reason] : unusable()) {
    ImageGeometry geometry = test::exampleGeometry(kFeatures);
    change(geometry);
    put(4, packedAsIs(geometry));
    expectRefused("image 4: ");
    expectRefused(reason);
    expectNone(4, reason);
  }
}

TEST_F(Landmarks, RowsOfAWrongSizeAreRefused) {
  const PackedGeometry good = packedAsIs(test::exampleGeometry(kFeatures));
  const auto resized = [](std::vector<std::uint8_t> bytes, std::size_t size) {
    bytes.resize(size);
    return bytes;
  };
  for (const std::size_t size : {0U, 1U, 139U, 141U, 280U}) {
    put(4, {resized(good.pose, size), good.points});
    expectRefused("pose of a camera has a wrong size");
    expectNone(4, "pose of a camera has a wrong size");
  }
  for (const std::size_t size : {1U, 19U, 22U, 199U}) {
    put(4, {good.pose, resized(good.points, size)});
    expectRefused("landmark is incomplete");
    expectNone(4, "landmark is incomplete");
  }
  put(4, {good.pose, resized(good.points, 20 * (kFeatures + 1))});
  expectRefused("more landmarks than features");
  expectNone(4, "more landmarks than features");
}

TEST_F(Landmarks, RowsThatDoNotFitTheImagesAreRefused) {
  const PackedGeometry good = packedAsIs(test::exampleGeometry(kFeatures));
  put(0, good);
  expectRefused("image 0: there are more landmarks than features");
  put(3, good);
  expectRefused("5 images have landmarks instead of 4");
  put(6, good);
  expectRefused("landmarks without an image");
  put(-1, good);
  expectRefused("landmarks without an image");
  restore();
  tamper("DELETE FROM landmarks WHERE image = 4");
  expectRefused("3 images have landmarks instead of 4");
  restore();
  tamper("UPDATE landmarks SET image = 3 WHERE image = 4");
  expectRefused("landmarks of image 3 do not agree with their checksum");
  restore();
  tamper("UPDATE landmarks SET crc32 = 'text' WHERE image = 4");
  expectRefused("wrong type");
}

TEST_F(Landmarks, TheirNumberIsVerified) {
  for (const auto& [value, reason] : {std::pair{"3", "does not agree with its checksum"},
                                      {"-1", "is not in [0, 100000000]"},
                                      {"9223372036854775807", "is not in [0, 100000000]"},
                                      {"'4'", "'geometry/images' is of the wrong type"}}) {
    restore();
    tamper(std::string("UPDATE meta SET value = ") + value + " WHERE key = 'geometry/images'");
    expectRefused(reason);
    EXPECT_THROW(loadMap(path_, {0}), MapStoreError);
  }
  restore();
  tamper("DELETE FROM meta WHERE key = 'geometry/images'");
  expectRefused("'geometry/images' is missing");
}

TEST_F(Landmarks, AnUnusableOneIsNotSaved) {
  std::vector<TrainingImage> images = test::exampleImages(6, kFeatures);
  images[4].geometry->camera.position_m.z() = kNan;
  EXPECT_THROW(TrainingMap(test::exampleHeader(), images), std::invalid_argument);
  MapWriter writer(folder_ / "other.map");
  writer.append(images[0]);
  try {
    writer.append(images[4]);
    ADD_FAILURE() << "accepted";
  } catch (const MapStoreError& error) {
    EXPECT_THAT(error.what(), HasSubstr("other.map: cannot be written: image 1: the camera's position"));
  }
}

}  // namespace
}  // namespace visual_localization

// What a map file says about the landmarks of an image: there and back, and refused where it cannot be.

#include <functional>
#include <iomanip>
#include <limits>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "map/map_schema.h"
#include "map/map_writer.h"
#include "test/map/stored_geometry.h"
#include "test/support/refusal.h"
#include "test/support/tamper.h"
#include "test/support/temporary_folder.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization {
namespace {

using map_schema::PackedGeometry;
using test::bytesOf;
using test::kFeatures;
using test::kNan;
using test::packedAsIs;
using testing::HasSubstr;

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
    const TrainingPoses poses = posesOf(test::exampleImages(6, kFeatures));
    const auto i = static_cast<std::size_t>(image);
    const std::int64_t seed = map_schema::rowSeed(i < poses.size() ? map_schema::rowOf(poses, i)
                                                                   : map_schema::ImageRow{image});  // of no image
    const std::int64_t crc32 = map_schema::rowChecksum(seed, {bytesOf(packed.pose), bytesOf(packed.points)});
    tamper("REPLACE INTO landmarks VALUES(" + std::to_string(image) + ", " + blob(packed.pose) + ", " +
           blob(packed.points) + ", " + std::to_string(crc32) + ")");
  }

  /// Read as a whole, read by --check.
  void expectRefused(const std::string& reason) const {
    for (const auto& read :
         std::vector<std::function<void()>>{[this] { loadMap(path_); }, [this] { checkMap(path_); }}) {
      EXPECT_THAT(test::refusalOf<MapStoreError>(read), HasSubstr(reason));
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
  for (const auto& [change, reason] : test::unusable()) {
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
  EXPECT_THAT(test::refusalOf<MapStoreError>([&] { writer.append(images[4]); }),
              HasSubstr("other.map: cannot be written: image 1: the camera's position"));
}

}  // namespace
}  // namespace visual_localization

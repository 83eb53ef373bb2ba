// A map file that somebody changed is refused, with the reason.

#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/map/stored_map.h"

namespace visual_localization {
namespace {

using test::exampleMap;
using test::expectSame;
using test::MapStore;
using testing::AllOf;
using testing::HasSubstr;

TEST_F(MapStore, RefusesAnotherSqliteFile) {
  tamper("PRAGMA application_id = 0");
  EXPECT_THAT(refusal(path_), HasSubstr("SQLite file, but not a map"));
}

TEST_F(MapStore, AnotherVersionIsRefusedByItsNumber) {
  for (const int version : {kMapSchemaVersion - 1, kMapSchemaVersion + 1}) {
    tamper("PRAGMA user_version = " + std::to_string(version));
    EXPECT_THAT(refusal(path_), AllOf(HasSubstr("map version " + std::to_string(version)),
                                      HasSubstr("only version " + std::to_string(kMapSchemaVersion))));
  }
}

TEST_F(MapStore, EveryTableAndValueMustBeThere) {
  tamper("DELETE FROM meta WHERE key = 'geometry/images'");
  EXPECT_THAT(refusal(path_), HasSubstr("'geometry/images' is missing"));
  tamper("DROP TABLE vlads");
  EXPECT_THAT(refusal(path_), HasSubstr("table 'vocabulary'"));
}

TEST_F(MapStore, RefusesEveryTruncation) {
  const std::string whole = test::readAll(path_);
  for (std::size_t length = 0; length < whole.size(); length += 1 + whole.size() / 150) {
    test::writeAll(path_, whole.substr(0, length));
    EXPECT_NE(refusal(path_), "") << length;
  }
  test::writeAll(path_, whole + "x");
  EXPECT_NE(refusal(path_), "");
}

TEST_F(MapStore, FlippedBytesAreRefusedOrHarmless) {
  const std::string whole = test::readAll(path_);
  std::mt19937 random(11);
  std::uniform_int_distribution<std::size_t> place(0, whole.size() - 1);
  std::uniform_int_distribution<int> mask(1, 255);
  std::size_t refused = 0;
  for (int round = 0; round < 400; ++round) {
    std::string damaged = whole;
    // Half of the flips in the first page, where the structure is.
    const std::size_t at = round % 2 == 0 ? place(random) : place(random) % 4096;
    damaged[at] = static_cast<char>(damaged[at] ^ mask(random));
    test::writeAll(path_, damaged);
    if (refusal(path_).empty()) {
      expectSame(exampleMap(), *loadMap(path_));
    } else {
      ++refused;
    }
  }
  EXPECT_GT(refused, 100U);
}

TEST_F(MapStore, RefusesAnyOtherSchema) {
  const std::string whole = test::readAll(path_);
  for (const char* sql :
       {"CREATE TRIGGER t AFTER INSERT ON images BEGIN DELETE FROM meta; END", "CREATE VIEW v AS SELECT * FROM images",
        "CREATE TABLE other(a)", "CREATE INDEX i ON images(session)", "ALTER TABLE images ADD COLUMN more",
        "DROP TABLE previews", "DROP TABLE images; CREATE VIEW images AS SELECT 1"}) {
    test::writeAll(path_, whole);
    tamper(sql);
    EXPECT_NE(refusal(path_), "") << sql;
  }
}

TEST_F(MapStore, RefusesChangedContent) {
  const std::string whole = test::readAll(path_);
  for (const char* sql : {"UPDATE images SET east_m = 9e999 WHERE id = 3",
                          "UPDATE images SET feature_count = -1 WHERE id = 3",
                          "UPDATE images SET feature_count = 9000000000000000000 WHERE id = 3",
                          "UPDATE images SET id = -5 WHERE id = 3",
                          "UPDATE images SET session = 4294967296 WHERE id = 3",
                          "DELETE FROM images WHERE id = 3",
                          "DELETE FROM images",
                          "UPDATE images SET north_m = 'north' WHERE id = 3",
                          "UPDATE images SET east_m = east_m + 1 WHERE id = 3",
                          "UPDATE meta SET value = -1 WHERE key = 'image/width_px'",
                          "DELETE FROM meta WHERE key = 'checksum'",
                          "UPDATE meta SET value = 'x' WHERE key = 'checksum'",
                          "UPDATE meta SET value = 1e99 WHERE key = 'sift/sigma'",
                          "INSERT INTO meta VALUES('extra', 1)",
                          "DELETE FROM meta",
                          "DELETE FROM features WHERE image = 3",
                          "DELETE FROM masks",
                          "INSERT INTO masks VALUES(1, (SELECT bits FROM masks))",
                          "UPDATE masks SET session = 1",
                          "UPDATE masks SET bits = zeroblob(9600)",
                          "UPDATE features SET keypoints = zeroblob(320) WHERE image = 3",
                          "UPDATE features SET descriptors = zeroblob(10000000) WHERE image = 3",
                          "INSERT INTO features VALUES(99, x'', x'', 0)",
                          "DELETE FROM previews WHERE image = 3",
                          "INSERT INTO previews VALUES(99, x'00', 0)",
                          "UPDATE globals SET wgoh = x'00' WHERE image = 3"}) {
    test::writeAll(path_, whole);
    tamper(sql);
    EXPECT_NE(refusal(path_), "") << sql;
  }
}

TEST_F(MapStore, CamerasAndMasksThatCannotBeAreRefused) {
  const std::string whole = test::readAll(path_);
  const std::string camera = "'session/0/camera/";
  const std::string mount = "'session/0/mount/";
  const struct {
    std::string sql, reason;
  } cases[] = {
      {"UPDATE meta SET value = 0.0 WHERE key = " + camera + "fx'", "fx = 0 is not in"},
      {"UPDATE meta SET value = 1e300 WHERE key = " + camera + "cx'", "cx = 1e+300"},
      {"UPDATE meta SET value = 640 WHERE key = " + camera + "width'", "does not agree with its checksum"},
      {"UPDATE meta SET value = -1 WHERE key = " + camera + "height'", "height = -1"},
      {"UPDATE meta SET value = 'fov' WHERE key = " + camera + "distortion'", "unknown distortion model 'fov'"},
      {"UPDATE meta SET value = 'x' WHERE key = " + camera + "d0'", "'d0' is of the wrong type"},
      {"UPDATE meta SET value = -9.0 WHERE key = " + camera + "d0'", "cannot be undone"},
      {"DELETE FROM meta WHERE key = " + camera + "fy'", "'fy' is missing"},
      {"INSERT INTO meta VALUES(" + camera + "zoom', 1.0)", "unknown value 'zoom'"},
      {"UPDATE meta SET value = 1e6 WHERE key = " + mount + "camera_x_m'", "the camera must be at most 100 m"},
      {"UPDATE meta SET value = 0.0 WHERE key = " + mount + "camera_qw'", "not of unit length"},
      {"UPDATE meta SET value = 'x' WHERE key = " + mount + "antenna_y_m'", "antenna_y_m"},
      {"DELETE FROM meta WHERE key = " + mount + "antenna_z_m'", "'antenna_z_m' is missing"},
      {"INSERT INTO meta VALUES(" + mount + "wheel', 1.0)", "mount/wheel' is unknown"},
      {"INSERT INTO meta VALUES('session/9/mask', 1)", "'session/9/mask' is unknown"},
      {"DELETE FROM meta WHERE key = 'session/0/mask'", "mask of session/0 is missing or unexpected"},
      {"DELETE FROM masks", "mask of session/0 is missing or unexpected"},
      {"UPDATE masks SET session = -1", "mask of session/0 is missing or unexpected"},
      {"INSERT INTO masks VALUES(7, x'00')", "a mask without a session"},
      {"UPDATE masks SET bits = x''", "does not agree with its checksum"},
      {"UPDATE masks SET bits = zeroblob(9600)", "does not agree with its checksum"}};
  for (const auto& [sql, reason] : cases) {
    test::writeAll(path_, whole);
    tamper(sql);
    EXPECT_THAT(refusal(path_), HasSubstr(reason)) << sql;
  }
}

TEST_F(MapStore, ImagesThatNoFrontEndCanHandleAreRefused) {
  const std::string whole = test::readAll(path_);
  const struct {
    int width, height;
    const char* reason;
  } cases[] = {{32768, 32768, "'image/height_px' = 32768 is not in [16, 16384]"},
               {16384, 1025, "its images are too large: 16384x1025 pixels, at most 16777216 are allowed"},
               {4096, 4097, "its images are too large: 4096x4097 pixels, at most 16777216 are allowed"},
               {4096, 4096, "a mask has 9600 bytes instead of 2097152"}};  // a size that is allowed
  for (const auto& [width, height, reason] : cases) {
    test::writeAll(path_, whole);
    tamper("UPDATE meta SET value = " + std::to_string(width) +
           " WHERE key = 'image/width_px'; UPDATE meta SET value = " + std::to_string(height) +
           " WHERE key = 'image/height_px'");
    EXPECT_THAT(refusal(path_), HasSubstr(reason)) << width << 'x' << height;
  }
}

TEST_F(MapStore, MasksOfAWrongSizeAreRefused) {
  const std::string whole = test::readAll(path_);
  // With the checksum that belongs to it: 3 bytes and 9600 zeros.
  for (const char* sql : {"UPDATE masks SET bits = x'616263'; UPDATE meta SET value = 891568578 WHERE key = "
                          "'session/0/mask'",
                          "UPDATE masks SET bits = zeroblob(9600); UPDATE meta SET value = 1369079857 WHERE key = "
                          "'session/0/mask'"}) {
    test::writeAll(path_, whole);
    tamper(sql);
    EXPECT_THAT(refusal(path_), testing::AnyOf(HasSubstr("a mask has 3 bytes instead of 9600"),
                                               HasSubstr("must use some of the image")))
        << sql;
  }
}

/// `count` floats as an SQL blob; the last one has these bytes in the file, in hexadecimal digits.
std::string histogramBlob(std::size_t count, const std::string& last) {
  return "x'" + std::string(8 * (count - 1), '0') + last + "'";
}

TEST_F(MapStore, RefusesWhatIsNoHistogram) {
  const std::string whole = test::readAll(path_);
  const std::string one = "0000803F";  // 1.0F, little-endian
  const struct {
    std::string blob, reason;
  } cases[] = {{histogramBlob(127, one), "global descriptor has a wrong size"},
               {histogramBlob(129, one), "global descriptor has a wrong size"},
               {histogramBlob(128, one + "00"), "global descriptor has a wrong size"},
               {"x''", "global descriptor has a wrong size"},
               {histogramBlob(128, "0000C07F"), "global descriptor is not finite"},              // NaN
               {histogramBlob(128, "0000807F"), "global descriptor is not finite"},              // infinity
               {histogramBlob(128, "000080BF"), "global descriptor is not finite or negative"},  // -1.0F
               {histogramBlob(128, "01000080"), "global descriptor is not finite or negative"},  // the smallest below 0
               {histogramBlob(128, one), "do not agree with their checksum"}};  // a good one, but not that image's
  for (const char* column : {"wgoh", "wgii"}) {
    for (const auto& [blob, reason] : cases) {
      test::writeAll(path_, whole);
      tamper(std::string("UPDATE globals SET ") + column + " = " + blob + " WHERE image = 3");
      EXPECT_THAT(refusal(path_), HasSubstr(reason)) << column << " " << blob;
    }
  }
}

}  // namespace
}  // namespace visual_localization

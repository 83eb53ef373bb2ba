#include "visual_localization/map/map_file.h"

#include <cstring>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "test/support/example_map.h"
#include "test/support/tamper.h"
#include "test/support/temporary_folder.h"

namespace visual_localization {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

TrainingMap exampleMap(std::size_t images = 12, std::size_t features = 20, unsigned seed = 1) {
  return {test::exampleHeader(), test::exampleImages(images, features, seed)};
}

/// Bit by bit, but for the sign of a zero.
void expectSame(const TrainingMap& a, const TrainingMap& b) {
  EXPECT_EQ(a.header().datum.latitude_deg, b.header().datum.latitude_deg);
  EXPECT_EQ(a.header().datum.longitude_deg, b.header().datum.longitude_deg);
  EXPECT_EQ(a.header().datum.altitude_m, b.header().datum.altitude_m);
  EXPECT_EQ(a.header().image_size, b.header().image_size);
  ASSERT_EQ(a.header().sessions.size(), b.header().sessions.size());
  for (std::size_t s = 0; s < a.header().sessions.size(); ++s) {
    EXPECT_EQ(a.header().sessions[s].name, b.header().sessions[s].name);
    EXPECT_EQ(a.header().sessions[s].camera, b.header().sessions[s].camera);
    EXPECT_TRUE(a.header().sessions[s].mask == b.header().sessions[s].mask);
    const auto& mount = a.header().sessions[s].mount;
    const auto& other = b.header().sessions[s].mount;
    ASSERT_EQ(mount.has_value(), other.has_value());
    if (!mount) continue;
    EXPECT_EQ(mount->camera.position_m, other->camera.position_m);
    EXPECT_LT(mount->camera.rotation.angularDistance(other->camera.rotation), 1e-12);
    EXPECT_EQ(mount->antenna_m, other->antenna_m);
  }
  EXPECT_EQ(a.header().sift.contrast_threshold, b.header().sift.contrast_threshold);
  EXPECT_EQ(a.header().sift.max_features, b.header().sift.max_features);
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(a.geometryCount(), b.geometryCount());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a.image(i).stamp_ns, b.image(i).stamp_ns);
    EXPECT_EQ(a.image(i).session, b.image(i).session);
    EXPECT_EQ(a.image(i).position_m, b.image(i).position_m);
    EXPECT_EQ(a.image(i).yaw_rad, b.image(i).yaw_rad);
    EXPECT_EQ(a.image(i).preview_jpeg, b.image(i).preview_jpeg);
    EXPECT_TRUE(test::same(a.image(i).geometry, b.image(i).geometry)) << i;
    EXPECT_EQ(a.image(i).global.wgoh, b.image(i).global.wgoh);
    EXPECT_EQ(a.image(i).global.wgii, b.image(i).global.wgii);
    EXPECT_EQ(a.image(i).sift.descriptors(), b.image(i).sift.descriptors());
    ASSERT_EQ(a.image(i).sift.size(), b.image(i).sift.size());
    if (a.image(i).sift.empty()) continue;
    EXPECT_EQ(0, std::memcmp(a.image(i).sift.keypoints().data(), b.image(i).sift.keypoints().data(),
                             a.image(i).sift.size() * sizeof(SiftKeypoint)));
  }
}

/// The one-line reason why the file is refused; empty when it is not.
std::string refusal(const std::string& path) {
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

std::string saveRefusal(const std::string& path) {
  try {
    saveMap(exampleMap(), path);
    return {};
  } catch (const MapStoreError& error) {
    return error.what();
  }
}

class MapStore : public testing::Test {
 protected:
  void SetUp() override { saveMap(exampleMap(), path_); }

  void tamper(const std::string& sql) const { test::tamper(path_, sql); }

  test::TemporaryFolder folder_;
  std::string path_ = folder_ / "a map?#%20.map";
};

TEST_F(MapStore, RoundTripIsIdentical) {
  expectSame(exampleMap(), *loadMap(path_));
  EXPECT_NO_THROW(checkMap(path_));
  EXPECT_EQ(originOf(path_).schema_version, 4);
  EXPECT_FALSE(originOf(path_).package_version.empty());
}

TEST_F(MapStore, SavingAgainWritesTheSameBytes) {
  const std::string again = folder_ / "again.map";
  saveMap(*loadMap(path_), again);
  EXPECT_EQ(test::readAll(path_), test::readAll(again));
}

TEST_F(MapStore, ReplacesAnExistingMap) {
  saveMap(exampleMap(3, 7, 9), path_);
  expectSame(exampleMap(3, 7, 9), *loadMap(path_));
}

TEST_F(MapStore, LeavesNoOtherFileBehind) {
  loadMap(path_);
  EXPECT_EQ(folder_.names().size(), 1U);
}

TEST_F(MapStore, ReadsFromAReadOnlyFolder) {
  std::filesystem::permissions(folder_.path(), std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  EXPECT_EQ(refusal(path_), "");
  std::filesystem::permissions(folder_.path(), std::filesystem::perms::owner_all);
}

TEST_F(MapStore, SaysWhyAFileIsNoMap) {
  EXPECT_THAT(refusal(folder_ / "absent"), HasSubstr("No such file"));
  EXPECT_THAT(refusal(folder_.path()), HasSubstr("is a folder"));
  test::writeAll(folder_ / "empty", "");
  EXPECT_THAT(refusal(folder_ / "empty"), HasSubstr("is empty"));
  test::writeAll(folder_ / "text", std::string(5000, 'x'));
  EXPECT_THAT(refusal(folder_ / "text"), HasSubstr("is not a map"));
  EXPECT_THAT(refusal("/dev/null"), HasSubstr("not a regular file"));
}

TEST_F(MapStore, RefusesAnotherSqliteFile) {
  tamper("PRAGMA application_id = 0");
  EXPECT_THAT(refusal(path_), HasSubstr("SQLite file, but not a map"));
}

TEST_F(MapStore, NamesBothVersions) {
  tamper("PRAGMA user_version = 7");
  EXPECT_THAT(refusal(path_), AllOf(HasSubstr("version 7"), HasSubstr("versions 3 to 4")));
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

TEST_F(MapStore, MapsOfVersion3HaveNoCamerasAndNoLandmarks) {
  const std::string old = std::string(TEST_DATA_DIR) + "/../fuzz/corpus/map/pages_of_2048.map";
  EXPECT_EQ(originOf(old).schema_version, 3);
  const auto map = loadMap(old);
  ASSERT_FALSE(map->header().sessions.empty());
  for (const Session& session : map->header().sessions) {
    EXPECT_FALSE(session.camera);
    EXPECT_TRUE(session.mask.empty());
  }
  for (const auto& opened : {map, loadMap(old, {0, [](const std::string& reason) { FAIL() << reason; }})}) {
    EXPECT_FALSE(opened->hasGeometry());
    EXPECT_EQ(opened->geometry(0), nullptr);
  }
  EXPECT_NO_THROW(checkMap(old));
  // Saved again it is a map of today.
  saveMap(*map, path_);
  EXPECT_EQ(originOf(path_).schema_version, 4);
  expectSame(*map, *loadMap(path_));
}

TEST_F(MapStore, AVersionHasItsOwnTablesAndValues) {
  tamper("PRAGMA user_version = 3");
  EXPECT_THAT(refusal(path_), HasSubstr("unexpected table 'landmarks'"));
  tamper("DROP TABLE landmarks");
  EXPECT_THAT(refusal(path_), HasSubstr("unexpected table 'masks'"));
  tamper("DROP TABLE masks");
  EXPECT_THAT(refusal(path_), HasSubstr("'geometry/images' is unknown"));
  tamper("DELETE FROM meta WHERE key = 'geometry/images'");
  EXPECT_THAT(refusal(path_), HasSubstr("'session/0/camera/cx' is unknown"));
  tamper("PRAGMA user_version = 4");
  EXPECT_THAT(refusal(path_), HasSubstr("its schema has an unexpected table"));
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

TEST_F(MapStore, SaysWhyAFileCannotBeWritten) {
  EXPECT_THAT(saveRefusal(folder_.path()), AllOf(StartsWith(folder_.path()), HasSubstr("is a folder")));
  EXPECT_THAT(saveRefusal(folder_ / "absent/a.map"), HasSubstr("folder does not exist"));
  EXPECT_THAT(saveRefusal(path_ + "/a.map"), HasSubstr("is not a folder"));
  EXPECT_THAT(saveRefusal("/dev/null"), HasSubstr("not a regular file"));
  EXPECT_THAT(saveRefusal(""), HasSubstr("empty"));
  EXPECT_EQ(folder_.names().size(), 1U);
}

TEST_F(MapStore, FullDiskLeavesTheOldMap) {
  // In a process of its own, because the limit is for a whole process.
  const pid_t child = ::fork();
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{20000, 20000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    const std::string text = saveRefusal(path_);
    ::_exit(text.rfind(path_ + ": cannot be written", 0) == 0 && folder_.names().size() == 1 ? 0 : 1);
  }
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  expectSame(exampleMap(), *loadMap(path_));
}

TEST_F(MapStore, KilledWhileSavingLeavesTheOldMapOrTheNewOne) {
  const TrainingMap old_map = exampleMap(20, 300, 2);
  const TrainingMap new_map = exampleMap(30, 300, 3);
  for (int round = 0; round < 25; ++round) {
    saveMap(old_map, path_);
    const pid_t child = ::fork();
    if (child == 0) {
      saveMap(new_map, path_);
      ::_exit(0);
    }
    ::usleep(static_cast<useconds_t>(round * 400));
    ::kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    const auto left = loadMap(path_);
    expectSame(left->size() == old_map.size() ? old_map : new_map, *left);
  }
}

}  // namespace
}  // namespace visual_localization

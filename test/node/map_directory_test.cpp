#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "node/node_config.h"
#include "test/support/refusal.h"
#include "test/support/temporary_folder.h"
#include "visual_localization/map/map_file.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

/// maps/ with a map, a folder and links; beside it secret.map and maps_of_others/.
class MapDirectory : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"maps", "maps/town", "maps_of_others"}) fs::create_directory(folder_ / name);
    for (const char* name : {"maps/a.map", "maps/town/b.map", "maps_of_others/c.map", "secret.map"}) {
      test::writeAll(folder_ / name, "map");
    }
    fs::create_symlink("../secret.map", folder_ / "maps/link.map");
    fs::create_symlink("..", folder_ / "maps/up");
    fs::create_symlink("town/b.map", folder_ / "maps/inside.map");
    fs::create_symlink("circular.map", folder_ / "maps/circular.map");
    fs::create_symlink("maps", folder_ / "link_to_maps");
  }

  std::string real(const std::string& name) const { return fs::canonical(folder_ / name).string(); }

  std::string refusal(const std::string& path) const {
    return test::refusalOf<MapStoreError>([&] { mapFileBelow(directory_, path); });
  }

  test::TemporaryFolder folder_;
  std::string directory_ = folder_ / "maps";
};

TEST_F(MapDirectory, EverythingMayBeOpenedWithoutOne) {
  for (const char* path : {"", "a.map", "../a.map", "/etc/passwd"}) EXPECT_EQ(mapFileBelow("", path), path);
}

TEST_F(MapDirectory, OpensWhatIsBelow) {
  for (const std::string& directory :
       {directory_, directory_ + "/", folder_ / "link_to_maps", folder_ / "maps/town/.."}) {
    EXPECT_EQ(mapFileBelow(directory, "a.map"), real("maps/a.map"));
    EXPECT_EQ(mapFileBelow(directory, "./town/../a.map"), real("maps/a.map"));
    EXPECT_EQ(mapFileBelow(directory, "town/b.map"), real("maps/town/b.map"));
    EXPECT_EQ(mapFileBelow(directory, "inside.map"), real("maps/town/b.map"));
    EXPECT_EQ(mapFileBelow(directory, folder_ / "maps/a.map"), real("maps/a.map"));
    EXPECT_EQ(mapFileBelow(directory, folder_ / "link_to_maps/a.map"), real("maps/a.map"));
    EXPECT_EQ(mapFileBelow(directory, "up/maps/a.map"), real("maps/a.map"));
    EXPECT_EQ(mapFileBelow(directory, "absent.map"), real("maps") + "/absent.map");
  }
}

TEST_F(MapDirectory, RefusesWhatIsElsewhere) {
  for (const std::string& path :
       {std::string("../secret.map"), std::string("town/../../secret.map"), std::string("/etc/passwd"),
        folder_ / "secret.map", folder_ / "maps_of_others/c.map", std::string("link.map"), std::string("up/secret.map"),
        std::string("up/absent.map"), std::string("absent/../../secret.map"), std::string("."), std::string("..")}) {
    EXPECT_THAT(refusal(path), AllOf(StartsWith(path + ": "), HasSubstr("not below ~map_directory '" + directory_)));
  }
}

/// As record_session writes its map.
TEST_F(MapDirectory, NothingIsWrittenOutside) {
  fs::create_symlink("../absent.map", folder_ / "maps/dangling.map");
  fs::create_symlink("../maps_of_others", folder_ / "maps/others");
  for (const char* path : {"link.map", "others/new.map", "others/../../new.map", "up/new.map"}) {
    EXPECT_THAT(refusal(path), HasSubstr("not below")) << path;
  }
  try {
    writeFile(mapFileBelow(directory_, "dangling.map"), "map");
  } catch (const std::runtime_error&) {
  }
  EXPECT_FALSE(fs::exists(folder_ / "absent.map"));
  for (const auto& entry : fs::directory_iterator(folder_ / "maps_of_others")) {
    EXPECT_EQ(entry.path().filename(), "c.map");
  }
}

TEST_F(MapDirectory, RefusesWhatIsNoName) {
  EXPECT_THAT(refusal(""), HasSubstr("not the name of a file"));
  EXPECT_THAT(refusal(std::string("../secret.map\0/../maps/a.map", 28)), HasSubstr("not the name of a file"));
  EXPECT_THAT(refusal("circular.map"), AllOf(StartsWith("circular.map: "), HasSubstr("~map_directory")));
  EXPECT_THAT(refusal(std::string(5000, 'x')), HasSubstr("~map_directory"));
  EXPECT_THAT(refusal("../two\nlines"), HasSubstr("~map_directory")) << "in one line";
}

TEST_F(MapDirectory, RefusesEverythingWhenThereIsNoSuchFolder) {
  directory_ = folder_ / "absent";
  EXPECT_THAT(refusal("a.map"), AllOf(StartsWith("a.map: "), HasSubstr("No such file")));
}

TEST(NodeConfig, MapDirectoryIsAbsolute) {
  NodeConfig config;
  EXPECT_TRUE(violationsOf(config).empty());
  config.map_directory = "/maps";
  EXPECT_TRUE(violationsOf(config).empty());
  config.map_directory = "maps";
  EXPECT_THAT(violationsOf(config), testing::ElementsAre(HasSubstr("'map_directory' = 'maps'")));
}

}  // namespace
}  // namespace visual_localization

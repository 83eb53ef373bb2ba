#include "visual_localization/map/map_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "test/map/stored_map.h"
#include "test/support/refusal.h"

namespace visual_localization {
namespace {

using test::exampleMap;
using test::expectSame;
using test::MapStore;
using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

std::string saveRefusal(const std::string& path) {
  try {
    saveMap(exampleMap(), path);
    return {};
  } catch (const MapStoreError& error) {
    return error.what();
  }
}

TEST_F(MapStore, RoundTripIsIdentical) {
  expectSame(exampleMap(), *loadMap(path_));
  EXPECT_NO_THROW(checkMap(path_));
  EXPECT_FALSE(packageVersionOf(path_).empty());
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

TEST_F(MapStore, AMapThatCouldNotBeOpenedIsNotSaved) {
  MapHeader header = test::exampleHeader();
  header.sessions = {{"monday"}, {"tuesday"}};
  header.image_size = {4096, 4097};
  std::vector<TrainingImage> images = test::exampleImages(6, 10);
  for (TrainingImage& image : images) image.geometry.reset();
  EXPECT_EQ(test::refusalOf<MapStoreError>([&] {
              saveMap({header, images}, path_);
            }),
            path_ +
                ": cannot be written: its images are too large: 4096x4097 pixels, at most 16777216 "
                "are allowed and 16384 a side");
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
  // What the killed ones left is removed by the next process that writes there.
  const pid_t child = ::fork();
  if (child == 0) {
    saveMap(old_map, path_);
    ::_exit(0);
  }
  ASSERT_EQ(::waitpid(child, nullptr, 0), child);
  EXPECT_EQ(folder_.names().size(), 1U);
}

}  // namespace
}  // namespace visual_localization

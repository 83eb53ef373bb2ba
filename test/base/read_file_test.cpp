#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "base/files.h"
#include "test/support/temporary_folder.h"

namespace visual_localization {
namespace {

TEST(ReadFile, GivesEveryByte) {
  const test::TemporaryFolder folder;
  const std::string content = std::string(200000, 'x') + '\0' + "\r\nend";
  test::writeAll(folder / "a", content);
  test::writeAll(folder / "empty", "");
  EXPECT_EQ(readFile(folder / "a"), content);
  EXPECT_EQ(readFile(folder / "empty"), "");
}

TEST(ReadFile, ReadsAPipeToItsEnd) {
  const test::TemporaryFolder folder;
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  std::thread writer([&folder] { test::writeAll(folder / "pipe", "through the pipe"); });
  EXPECT_EQ(readFile(folder / "pipe"), "through the pipe");
  writer.join();
}

TEST(ReadFile, WaitsForNoOneAndReadsNoDevice) {
  const test::TemporaryFolder folder;
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  for (const std::string& path : {folder / "pipe", std::string("/dev/zero"), std::string("/dev/null")}) {
    try {
      readFile(path);
      ADD_FAILURE() << "read: " << path;
    } catch (const FileError& error) {
      EXPECT_THAT(error.what(), ::testing::StartsWith(path + ": cannot be read: "));
    }
  }
}

TEST(ReadFile, NamesWhatCannotBeRead) {
  const test::TemporaryFolder folder;
  for (const std::string& path : {folder / "absent", folder.path()}) {
    try {
      readFile(path);
      ADD_FAILURE() << "read: " << path;
    } catch (const FileError& error) {
      EXPECT_THAT(error.what(), ::testing::StartsWith(path + ": cannot be read: "));
    }
  }
  EXPECT_THROW(readFile(""), FileError);
}

TEST(ReadFile, TakesNoMoreThanIsAllowed) {
  const test::TemporaryFolder folder;
  test::writeAll(folder / "a", "12345");
  EXPECT_EQ(readFile(folder / "a", 5), "12345");
  EXPECT_THROW(readFile(folder / "a", 4), FileError);
  EXPECT_THROW(readFile("/dev/zero", 100), FileError);
}

}  // namespace
}  // namespace visual_localization

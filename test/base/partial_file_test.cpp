#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/files.h"
#include "test/support/temporary_folder.h"

namespace visual_localization {
namespace {

TEST(PartialFile, ReplacesTheTargetOnlyOnCommit) {
  const test::TemporaryFolder folder;
  test::writeAll(folder / "a", "old");
  {
    PartialFile file(folder / "a");
    test::writeAll(file.path(), "new");
    EXPECT_EQ(test::readAll(folder / "a"), "old");
    file.commit();
  }
  EXPECT_EQ(test::readAll(folder / "a"), "new");
  EXPECT_EQ(folder.names().size(), 1U);
}

TEST(PartialFile, DisappearsWithoutCommit) {
  const test::TemporaryFolder folder;
  { const PartialFile file(folder / "a"); }
  EXPECT_TRUE(folder.names().empty());
}

TEST(PartialFile, FollowsALink) {
  const test::TemporaryFolder folder;
  writeFile(folder / "a", "old");
  std::filesystem::create_symlink(folder / "a", folder / "link");
  writeFile(folder / "link", "new");
  EXPECT_EQ(test::readAll(folder / "a"), "new");
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
}

TEST(PartialFile, RefusesWhatIsNoFile) {
  const test::TemporaryFolder folder;
  EXPECT_THROW(writeFile(folder.path(), "x"), FileError);
  EXPECT_THROW(writeFile("/dev/null", "x"), FileError);
  EXPECT_THROW(writeFile(folder / "absent/a", "x"), FileError);
  EXPECT_THROW(writeFile("", "x"), FileError);
}

TEST(PartialFile, DisappearsWhenTheProcessIsInterrupted) {
  const test::TemporaryFolder folder;
  for (const int signal_number : {SIGINT, SIGTERM}) {
    const pid_t child = ::fork();
    if (child == 0) {
      removePartialFilesOnSignals();
      const PartialFile file(folder / "a");
      ::raise(signal_number);
      ::_exit(0);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == signal_number);
    EXPECT_TRUE(folder.names().empty());
  }
}

}  // namespace
}  // namespace visual_localization

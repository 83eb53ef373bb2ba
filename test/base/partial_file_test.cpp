#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/files.h"
#include "test/support/temporary_folder.h"

namespace visual_localization {
namespace {

/// A process that does something and then waits to be killed.
class Child {
 public:
  template <class Act>
  explicit Child(Act act) {
    int ready[2];
    if (::pipe(ready) != 0) throw std::runtime_error("no pipe");
    pid_ = ::fork();
    if (pid_ == 0) {
      const auto held = act();
      if (::write(ready[1], "r", 1) != 1) ::_exit(1);
      while (true) ::pause();
    }
    ::close(ready[1]);
    char byte = 0;
    is_ready_ = ::read(ready[0], &byte, 1) == 1;
    ::close(ready[0]);
  }
  ~Child() { kill(); }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  bool isReady() const { return is_ready_; }
  pid_t pid() const { return pid_; }
  void kill() {
    if (pid_ > 0) ::kill(pid_, SIGKILL);
    if (pid_ > 0) ::waitpid(pid_, nullptr, 0);
    pid_ = 0;
  }

 private:
  pid_t pid_ = 0;
  bool is_ready_ = false;
};

TEST(PartialFile, WhatKilledProcessesLeaveIsRemovedByTheNextOne) {
  const test::TemporaryFolder folder;
  const auto begin = [&folder] { return std::make_unique<PartialFile>(folder / "a"); };
  Child killed(begin);
  ASSERT_TRUE(killed.isReady());
  const std::vector<std::string> abandoned = folder.names();
  ASSERT_EQ(abandoned.size(), 1U);
  killed.kill();
  EXPECT_EQ(folder.names(), abandoned);
  test::writeAll(folder / "mine.partial", "of another program");
  const Child living(begin);
  ASSERT_TRUE(living.isReady());
  EXPECT_FALSE(std::filesystem::exists(folder / abandoned.front()));
  EXPECT_EQ(folder.names().size(), 2U);
  writeFile(folder / "b", "x");  // in any file's name
  EXPECT_EQ(folder.names().size(), 3U);
}

TEST(PartialFile, SeveralOfOneTargetHaveNamesOfTheirOwn) {
  const test::TemporaryFolder folder;
  PartialFile first(folder / "a");
  PartialFile second(folder / "a");
  EXPECT_EQ(folder.names().size(), 2U);
  first.write("first");
  second.write("second");
  second.commit();
  first.commit();
  EXPECT_EQ(test::readAll(folder / "a"), "first");
}

TEST(OutputLock, OneProcessAtATimeWrites) {
  const test::TemporaryFolder folder;
  const std::string target = folder / "a";
  Child holder([&target] { return std::make_unique<OutputLock>(target); });
  ASSERT_TRUE(holder.isReady());
  try {
    const OutputLock lock(target);
    FAIL() << "held twice";
  } catch (const FileError& error) {
    const std::string expected = target + ": cannot be written: process " + std::to_string(holder.pid()) + " on ";
    EXPECT_EQ(std::string(error.what()).rfind(expected, 0), 0U) << error.what();
  }
  EXPECT_NO_THROW(OutputLock(folder / "b"));
  holder.kill();
  EXPECT_EQ(folder.names().size(), 1U);
  { const OutputLock lock(target); }
  EXPECT_TRUE(folder.names().empty());
}

TEST(OutputLock, WaitsForWhoeverHoldsItForAMoment) {
  const test::TemporaryFolder folder;
  const std::string target = folder / "a";
  auto other = std::make_unique<OutputLock>(target);
  std::thread release([&other] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    other.reset();
  });
  EXPECT_NO_THROW(OutputLock{target});
  release.join();
}

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

mode_t modeOf(const std::string& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 ? status.st_mode & 07777 : 0;
}

TEST(PartialFile, HasThePermissionsOfTheFileThatItReplaces) {
  const test::TemporaryFolder folder;
  const mode_t before = ::umask(022);
  writeFile(folder / "new", "x");
  EXPECT_EQ(modeOf(folder / "new"), 0644U);
  for (const mode_t mode : {0600U, 0640U, 0666U, 0444U}) {
    ASSERT_EQ(::chmod((folder / "new").c_str(), mode), 0);
    PartialFile file(folder / "new");
    EXPECT_EQ(modeOf(file.path()) & 077U, mode & 077U) << "nobody else reads it meanwhile either";
    file.write("y");
    file.commit();
    EXPECT_EQ(modeOf(folder / "new"), mode);
  }
  ::umask(before);
}

TEST(PartialFile, RootsFileStaysItsOwners) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can give a file away";
  const test::TemporaryFolder folder;
  writeFile(folder / "a", "x");
  ASSERT_EQ(::chown((folder / "a").c_str(), 1234, 1235), 0);
  writeFile(folder / "a", "y");
  struct stat status {};
  ASSERT_EQ(::stat((folder / "a").c_str(), &status), 0);
  EXPECT_EQ(status.st_uid, 1234U);
  EXPECT_EQ(status.st_gid, 1235U);
}

TEST(PartialFile, FilesOfOtherProgramsStay) {
  const test::TemporaryFolder folder;
  const std::vector<std::string> others{"film.0123456789abcdef.partial", "film.lock.partial",
                                        "a.visual_localization.partial", ".visual_localization.partial"};
  for (const std::string& name : others) test::writeAll(folder / name, "of another program");
  writeFile(folder / "a", "x");
  EXPECT_EQ(folder.names().size(), others.size() + 1);
}

TEST(PartialFile, ALinkThatLeadsToNoFileIsReplacedWhereItIs) {
  const test::TemporaryFolder folder;
  const test::TemporaryFolder outside;
  std::filesystem::create_symlink(outside / "a", folder / "link");
  writeFile(folder / "link", "x");
  EXPECT_FALSE(std::filesystem::is_symlink(folder / "link"));
  EXPECT_EQ(test::readAll(folder / "link"), "x");
  EXPECT_TRUE(outside.names().empty());
}

TEST(PartialFile, RefusesWhatIsNoFile) {
  const test::TemporaryFolder folder;
  EXPECT_THROW(writeFile(folder.path(), "x"), FileError);
  EXPECT_THROW(writeFile("/dev/null", "x"), FileError);
  EXPECT_THROW(writeFile(folder / "absent/a", "x"), FileError);
  EXPECT_THROW(writeFile("", "x"), FileError);
}

/// A network disk that answers each of these calls of this process with `error`, for ever. False where the system has
/// no such filter.
bool refuseCalls(const std::vector<unsigned>& calls, int error) {
  std::vector<sock_filter> filter{BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr))};
  for (const unsigned call : calls) {
    filter.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, call, 0, 1));
    filter.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | static_cast<unsigned>(error)));
  }
  filter.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW));
  const sock_fprog program{static_cast<unsigned short>(filter.size()), filter.data()};
  return ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

constexpr int kNoFilter = 77;

/// What `act` returns in a process of its own whose calls are refused.
template <class Act>
int withoutCalls(const std::vector<unsigned>& calls, int error, Act act) {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(refuseCalls(calls, error) ? act() : kNoFilter);
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(PartialFile, AFileSystemWithoutLocksIsWrittenAndLeftClean) {
  for (const int error : {ENOLCK, EOPNOTSUPP, ENOSYS}) {
    const test::TemporaryFolder folder;
    const std::string target = folder / "a";
    const int outcome = withoutCalls({SYS_flock}, error, [&target] {
      const OutputLock lock(target);
      writeFile(target, "new");
      return 0;
    });
    if (outcome == kNoFilter) GTEST_SKIP() << "no filter of system calls here";
    EXPECT_EQ(outcome, 0);
    EXPECT_EQ(folder.names().size(), 1U) << "the lock would stay for ever, since nobody can lock it to remove it";
    EXPECT_EQ(test::readAll(target), "new");
  }
}

TEST(PartialFile, WhatAnotherMachineMayBeWritingStaysForADay) {
  const test::TemporaryFolder folder;
  const std::string name = "b.0123456789abcdef.visual_localization.partial";
  test::writeAll(folder / name, "theirs");
  for (const bool is_old : {false, true}) {
    if (is_old) {
      const auto now = std::filesystem::file_time_type::clock::now();
      std::filesystem::last_write_time(folder / name, now - std::chrono::hours(25));
    }
    const int outcome = withoutCalls({SYS_fstatfs}, EIO, [&folder] {  // the disk may be a network's
      writeFile(folder / "a", "mine");
      return 0;
    });
    if (outcome == kNoFilter) GTEST_SKIP() << "no filter of system calls here";
    EXPECT_EQ(outcome, 0);
    EXPECT_EQ(std::filesystem::exists(folder / name), !is_old);
  }
}

std::vector<unsigned> renames() {
  return {
#ifdef SYS_rename
      SYS_rename,
#endif
#ifdef SYS_renameat
      SYS_renameat,
#endif
      SYS_renameat2};
}

TEST(PartialFile, ANetworkDiskThatGoesAwayKeepsTheOldFile) {
  const test::TemporaryFolder folder;
  const std::string target = folder / "a";
  writeFile(target, "old");
  const std::vector<unsigned> flushes{SYS_fsync};
  for (const std::vector<unsigned>& calls : {renames(), flushes}) {
    for (const int error : {ESTALE, EIO, EROFS}) {
      const int outcome = withoutCalls(calls, error, [&] {
        try {
          writeFile(target, "new");
        } catch (const FileError& refusal) {
          return refusal.what() == target + ": cannot be written: " + std::strerror(error) ? 0 : 1;
        }
        return 2;
      });
      if (outcome == kNoFilter) GTEST_SKIP() << "no filter of system calls here";
      EXPECT_EQ(outcome, 0) << std::strerror(error);
      EXPECT_EQ(folder.names().size(), 1U);
      EXPECT_EQ(test::readAll(target), "old");
    }
  }
}

/// As a program that was started from a terminal: one in the background of a script ignores SIGINT.
void startInTheForeground() {
  ::signal(SIGINT, SIG_DFL);
  removePartialFilesOnSignals();
}

TEST(PartialFile, DisappearsWhenTheProcessIsInterrupted) {
  const test::TemporaryFolder folder;
  for (const int signal_number : {SIGINT, SIGTERM}) {
    const pid_t child = ::fork();
    if (child == 0) {
      startInTheForeground();
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

/// Gives them up again, in several threads, until the process ends.
[[noreturn]] void makeFilesWithoutEnd(const std::string& target) {
  const auto work = [&target] {
    while (true) const PartialFile file(target);
  };
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) threads.emplace_back(work);
  while (true) const OutputLock lock(target);
}

TEST(PartialFile, DisappearsWhenTheProcessIsInterruptedWhileAnotherThreadMakesIt) {
  const test::TemporaryFolder folder;
  constexpr int kTimes = 100;
  for (int i = 0; i < kTimes; ++i) {
    const pid_t child = ::fork();
    if (child == 0) {
      startInTheForeground();
      makeFilesWithoutEnd(folder / "a");
    }
    ASSERT_GT(child, 0);
    while (folder.names().empty()) ::usleep(100);
    ::usleep(static_cast<useconds_t>(97 * i));
    const int signal_number = i % 2 == 0 ? SIGINT : SIGTERM;
    ::kill(child, signal_number);
    if (i % 3 == 0) ::kill(child, signal_number);  // somebody presses Ctrl-C twice
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == signal_number) << status;
    ASSERT_TRUE(folder.names().empty()) << folder.names().front() << " after " << i;
  }
}

}  // namespace
}  // namespace visual_localization

#include "base/process.h"

#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <future>
#include <new>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

namespace visual_localization {
namespace {

using testing::HasSubstr;

std::string refusalOf(const std::string& program, const std::vector<std::string>& arguments,
                      const std::string& hint = "") {
  try {
    ChildProcess(0, hint).run(program, arguments);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(ChildProcess, ReturnsWhatTheProgramWarnsOf) {
  EXPECT_EQ(ChildProcess().run("/bin/sh", {"-c", "echo careful >&2; echo \"$0\" >&2", "a b"}), "careful\na b\n");
  EXPECT_EQ(ChildProcess().run("/bin/true", {}), "");
}

TEST(ChildProcess, RefusesWithTheLastLineOfAProgramThatFails) {
  EXPECT_EQ(refusalOf("/bin/sh", {"-c", "echo first >&2; echo last >&2; exit 3"}), "/bin/sh: failed: last");
  EXPECT_EQ(refusalOf("/bin/false", {}), "/bin/false: failed: without a message");
  EXPECT_EQ(refusalOf("/bin/sh", {"-c", "kill -9 $$"}), "/bin/sh: failed: without a message");
}

TEST(ChildProcess, SaysWhatMayBeMissing) {
  EXPECT_EQ(refusalOf("/absent", {}, "is it installed? "),
            "/absent: cannot be started: is it installed? No such file or directory");
}

TEST(ChildProcess, IsNicerThanThisProcessByWhatWasAskedFor) {
  ASSERT_NE(::nice(2), -1);
  EXPECT_EQ(ChildProcess(5).run("/bin/sh", {"-c", "sleep 0.3; nice >&2"}), std::to_string(::nice(0) + 5) + "\n");
}

TEST(ChildProcess, EndsWhenItIsTerminated) {
  ChildProcess child;
  auto refusal = std::async(std::launch::async, [&child]() -> std::string {
    try {
      return child.run("/bin/sh", {"-c", "echo begun >&2; exec sleep 600 2>&-"});
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  });
  EXPECT_EQ(refusal.wait_for(std::chrono::milliseconds(300)), std::future_status::timeout);
  child.terminate();
  EXPECT_EQ(refusal.get(), "/bin/sh: failed: begun");
  EXPECT_THROW(child.run("/bin/true", {}), std::runtime_error) << "nor does another one start";
}

constexpr std::size_t kMiB = std::size_t{1} << 20U;

std::string endOf(const std::function<void()>& run, unsigned longest_s = 10) {
  return howCopyEnds(run, longest_s, 64 * kMiB);
}

TEST(HowCopyEnds, IsEmptyWhereItComesToItsEnd) {
  int here = 1;
  EXPECT_EQ(endOf([&here] { here = 2; }), "");
  EXPECT_EQ(here, 1) << "what it does must not be done here";
}

TEST(HowCopyEnds, ThrowsWhatItThrows) {
  try {
    endOf([] { throw std::out_of_range("refused"); });
    ADD_FAILURE();
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "refused");
  }
  EXPECT_THROW(endOf([] { throw 1; }), std::runtime_error);
}

TEST(HowCopyEnds, NamesWhatEndedIt) {
  EXPECT_EQ(endOf([] { std::raise(SIGFPE); }), "by signal 8 (Floating point exception)");
  EXPECT_EQ(endOf([] { std::abort(); }), "by signal 6 (Aborted)");
  EXPECT_EQ(endOf([] { std::_Exit(3); }), "with exit code 3");
  EXPECT_EQ(endOf([] { std::this_thread::sleep_for(std::chrono::hours(1)); }, 1), "after 1 s without a result");
}

// By the kernel's own call: a sanitizer's operator new does not throw.
TEST(HowCopyEnds, MemoryBeyondTheBoundIsRefused) {
  const auto take = [](std::size_t bytes) {
    const void* block = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (block == MAP_FAILED) throw std::bad_alloc();
  };
  EXPECT_EQ(endOf([&] { take(32 * kMiB); }), "");
  EXPECT_THROW(endOf([&] { take(65 * kMiB); }), std::runtime_error);
  EXPECT_THROW(endOf([&] {
                 for (int i = 0; i < 10; ++i) take(8 * kMiB);
               }),
               std::runtime_error);
  EXPECT_NO_THROW(take(65 * kMiB)) << "here it is not";
}

TEST(HowCopyEnds, ItIsTheFirstToEndWhereMemoryRunsOut) {
  const auto require_score = [] {
    int score = 0;
    std::ifstream("/proc/self/oom_score_adj") >> score;
    if (score != 1000) std::_Exit(1);
  };
  EXPECT_EQ(endOf(require_score), "");
}

TEST(ProgramOfPackage, FindsProgramsBesideTheLibrary) {
  const std::string program = programOfPackage("map_info");  // this test lies elsewhere
  EXPECT_TRUE(std::filesystem::exists(program));
  EXPECT_THAT(ChildProcess().run(program, {"--version"}), "");
}

TEST(ProgramOfPackage, NamesWhatIsMissing) {
  try {
    programOfPackage("map_absent");
    ADD_FAILURE();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("/map_absent: is missing"));
  }
}

}  // namespace
}  // namespace visual_localization

#include "base/parallel.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <pthread.h>

namespace visual_localization {
namespace {

/// Threads get a stack that no machine has, so that the system refuses them.
class NoThreads {
 public:
  NoThreads() {
    ::pthread_getattr_default_np(&before_);
    pthread_attr_t huge;
    ::pthread_attr_init(&huge);
    ::pthread_attr_setstacksize(&huge, std::size_t{1} << 48U);
    ::pthread_setattr_default_np(&huge);
    ::pthread_attr_destroy(&huge);
  }
  ~NoThreads() {
    ::pthread_setattr_default_np(&before_);
    ::pthread_attr_destroy(&before_);
  }
  NoThreads(const NoThreads&) = delete;
  NoThreads& operator=(const NoThreads&) = delete;

 private:
  pthread_attr_t before_{};
};

std::vector<int> timesDone(std::size_t count, std::size_t threads) {
  std::vector<std::atomic<int>> times(count);
  parallelFor(count, threads, [&times](std::size_t i) { ++times[i]; });
  return {times.begin(), times.end()};
}

TEST(ParallelFor, DoesEveryTaskOnce) {
  for (const std::size_t threads : {0, 1, 2, 7, 1000}) {
    EXPECT_EQ(timesDone(100, threads), std::vector<int>(100, 1)) << threads << " threads";
  }
  EXPECT_TRUE(timesDone(0, 4).empty());
}

TEST(ParallelFor, WorksOnSeveralTasksAtOnce) {
  std::mutex mutex;
  std::condition_variable changed;
  int waiting = 0;
  bool met = true;
  parallelFor(2, 2, [&](std::size_t) {
    std::unique_lock<std::mutex> lock(mutex);
    ++waiting;
    changed.notify_all();
    if (!changed.wait_for(lock, std::chrono::seconds(20), [&waiting] { return waiting == 2; })) met = false;
  });
  EXPECT_TRUE(met);
}

TEST(ParallelFor, NoTwoTasksHaveTheSameWorkerAtTheSameTime) {
  for (const std::size_t threads : {1, 2, 7}) {
    std::vector<std::atomic<int>> busy(threads);
    std::atomic<bool> shared{false};
    std::atomic<int> done{0};
    parallelFor(200, threads, [&](std::size_t, std::size_t worker) {
      if (worker >= threads || ++busy[worker] != 1) {
        shared = true;
        return;
      }
      std::this_thread::yield();
      --busy[worker];
      ++done;
    });
    EXPECT_FALSE(shared) << threads << " threads";
    EXPECT_EQ(done, 200);
  }
}

TEST(ParallelFor, OneThreadIsTheCallingOneUnlessItReports) {
  std::thread::id working;
  const auto task = [&working](std::size_t) { working = std::this_thread::get_id(); };
  parallelFor(3, 1, task);
  EXPECT_EQ(working, std::this_thread::get_id());
  parallelFor(3, 1, task, [](std::size_t, std::size_t) {});
  EXPECT_NE(working, std::this_thread::get_id());
}

TEST(ParallelFor, AnErrorEndsTheWorkAndIsThrownAgain) {
  std::atomic<int> done{0};
  const auto task = [&done](std::size_t i) {
    if (i == 10) throw std::runtime_error("task 10");
    ++done;
  };
  try {
    parallelFor(1000000, 1, task);
    ADD_FAILURE() << "no error";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "task 10");
  }
  EXPECT_EQ(done, 10);
  EXPECT_THROW(parallelFor(100, 4, task), std::runtime_error);
}

TEST(ParallelFor, ReportsProgressWhileItWorks) {
  std::atomic<bool> reported{false};
  parallelFor(
      2, 2,
      [&reported](std::size_t) {
        const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
        while (!reported && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
      },
      [&reported](std::size_t done, std::size_t total) {
        EXPECT_LE(done, 2U);
        EXPECT_EQ(total, 2U);
        reported = true;
      });
  EXPECT_TRUE(reported);
}

TEST(ParallelFor, ThrowsWhatTheProgressThrowsWhenNoTaskRunsAnyMore) {
  std::atomic<int> running{0};
  std::atomic<bool> reported{false};
  const auto task = [&](std::size_t) {
    ++running;
    while (!reported) std::this_thread::yield();
    --running;
  };
  const auto progress = [&reported](std::size_t, std::size_t) {
    reported = true;
    throw std::runtime_error("nobody is looking");
  };
  EXPECT_THROW(parallelFor(4, 2, task, progress), std::runtime_error);
  EXPECT_EQ(running, 0);
}

TEST(ParallelFor, DoesWithoutThreadsThatTheSystemRefuses) {
  const NoThreads refused;
  EXPECT_EQ(timesDone(100, 8), std::vector<int>(100, 1));
}

}  // namespace
}  // namespace visual_localization

#include "base/parallel.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace visual_localization {
namespace {

/// As many threads as the system grants, `wanted` at most.
std::vector<std::thread> startThreads(std::size_t wanted, const std::function<void()>& work) {
  std::vector<std::thread> pool;
  pool.reserve(wanted);
  try {
    while (pool.size() < wanted) pool.emplace_back(work);
  } catch (const std::system_error&) {
    // The threads that did start share the work.
  }
  return pool;
}

/// The tasks that are left, shared by the threads that do them.
class TaskQueue {
 public:
  using Task = std::function<void(std::size_t i, std::size_t worker)>;

  TaskQueue(std::size_t count, const Task& task) : count_(count), task_(task) {}

  void work() noexcept {
    const std::size_t worker = workers_++;
    for (std::size_t i = next_++; i < count_; i = next_++) {
      try {
        task_(i, worker);
      } catch (...) {
        const std::lock_guard<std::mutex> lock(mutex_);
        if (!error_) error_ = std::current_exception();
        next_ = count_;
      }
      ++done_;
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    ++finished_threads_;
    changed_.notify_all();
  }

  void waitFor(std::size_t threads, const Progress& progress) {
    constexpr std::chrono::milliseconds kInterval{100};
    std::unique_lock<std::mutex> lock(mutex_);
    while (!changed_.wait_for(lock, kInterval, [&] { return finished_threads_ == threads; })) {
      if (!progress) continue;
      lock.unlock();
      progress(done_, count_);
      lock.lock();
    }
    if (error_) std::rethrow_exception(error_);
  }

 private:
  const std::size_t count_;
  const Task& task_;
  std::atomic<std::size_t> workers_{0};
  std::atomic<std::size_t> next_{0};
  std::atomic<std::size_t> done_{0};
  std::mutex mutex_;
  std::condition_variable changed_;
  std::exception_ptr error_;
  std::size_t finished_threads_ = 0;
};

}  // namespace

void parallelFor(std::size_t count, std::size_t threads,
                 const std::function<void(std::size_t i, std::size_t worker)>& task, const Progress& progress) {
  TaskQueue queue(count, task);
  const std::size_t wanted = std::max<std::size_t>(1, std::min(threads, count));
  // The calling thread works as well, unless it has something to report meanwhile.
  std::vector<std::thread> pool = startThreads(progress ? wanted : wanted - 1, [&queue] { queue.work(); });
  const bool works = !progress || pool.empty();
  if (works) queue.work();
  std::exception_ptr error;
  try {
    queue.waitFor(pool.size() + (works ? 1 : 0), progress);
  } catch (...) {
    error = std::current_exception();
  }
  for (std::thread& thread : pool) thread.join();
  if (error) std::rethrow_exception(error);
}

void parallelFor(std::size_t count, std::size_t threads, const std::function<void(std::size_t)>& task,
                 const Progress& progress) {
  parallelFor(
      count, threads, [&task](std::size_t i, std::size_t) { task(i); }, progress);
}

}  // namespace visual_localization

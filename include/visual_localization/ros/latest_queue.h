#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <utility>

namespace visual_localization {

/// A queue of one between threads: a newer item replaces one that nobody has taken yet, so that a slow
/// consumer always works on the newest.
template <class Item>
class LatestQueue {
 public:
  /// Never blocks. Counts the item that it replaces, if there is one.
  void push(Item item) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (closed_) return;
      if (item_) ++dropped_;
      item_ = std::move(item);
    }
    available_.notify_one();
  }

  /// Waits for an item; nothing once the queue is closed.
  std::optional<Item> pop() {
    std::unique_lock<std::mutex> lock(mutex_);
    available_.wait(lock, [this] { return closed_ || item_; });
    if (closed_) return std::nullopt;
    return std::exchange(item_, std::nullopt);
  }

  /// Ends every wait, now and later.
  void close() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      closed_ = true;
      item_.reset();
    }
    available_.notify_all();
  }

  /// Items that were replaced before anybody took them.
  std::uint64_t dropped() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return dropped_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable available_;
  std::optional<Item> item_;
  std::uint64_t dropped_ = 0;
  bool closed_ = false;
};

}  // namespace visual_localization

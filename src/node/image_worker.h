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

/// Tells images that come late from time that goes back: an image older than the newest one is late; when the next one
/// is older too, and not older than that one, time has gone back, as when a bag begins anew. One image of a new round
/// is lost by that, and two publishers whose clocks differ cannot drag the time to and fro.
class StampMonitor {
 public:
  enum class Verdict : std::uint8_t {
    kInOrder,   ///< not older than the newest
    kLate,      ///< older, of no use any more
    kWentBack,  ///< older, and the beginning of another time
  };

  /// `stamp_ns` of the image that came now.
  Verdict judge(std::int64_t stamp_ns);
  /// How much older than the newest image the last one was, seconds; zero when it was not.
  double lag_s() const { return lag_s_; }

 private:
  std::optional<std::int64_t> newest_ns_;
  std::optional<std::int64_t> late_ns_;  ///< of the image before, if that was late
  double lag_s_ = 0.0;
};

}  // namespace visual_localization

#pragma once

#include <chrono>
#include <mutex>
#include <optional>

namespace visual_localization {

/// Lets a repeated warning through once per period of wall time. Unlike the macros of roscpp it belongs to
/// one object, so that two localizers in one process do not silence each other.
class Throttle {
 public:
  using Clock = std::chrono::steady_clock;

  explicit Throttle(std::chrono::milliseconds period = std::chrono::seconds(5)) : period_(period) {}

  bool ready() {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto now = Clock::now();
    if (last_ && now - *last_ < period_) return false;
    last_ = now;
    return true;
  }

 private:
  std::chrono::milliseconds period_;
  std::mutex mutex_;
  std::optional<Clock::time_point> last_;
};

}  // namespace visual_localization

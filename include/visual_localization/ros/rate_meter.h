#pragma once

#include <chrono>
#include <deque>

namespace visual_localization {

/// Rate of events over the last seconds. One that is slower than the reports shows its rate too, not one and nought in
/// turn.
class RateMeter {
 public:
  using Clock = std::chrono::steady_clock;

  explicit RateMeter(std::chrono::milliseconds window = std::chrono::seconds(10)) : window_(window) {}

  void add(Clock::time_point now = Clock::now()) {
    times_.push_back(now);
    forget(now);
  }

  /// Hertz; zero with fewer than two events in the window.
  double rate_hz(Clock::time_point now = Clock::now()) {
    forget(now);
    if (times_.size() < 2) return 0.0;
    const double span_s = std::chrono::duration<double>(times_.back() - times_.front()).count();
    return span_s > 0.0 ? static_cast<double>(times_.size() - 1) / span_s : 0.0;
  }

 private:
  void forget(Clock::time_point now) {
    while (!times_.empty() && now - times_.front() > window_) times_.pop_front();
  }

  std::chrono::milliseconds window_;
  std::deque<Clock::time_point> times_;
};

}  // namespace visual_localization

#pragma once

#include <chrono>
#include <cstddef>
#include <string>

namespace visual_localization::apps {

/// A line on standard error that shows how far a long step is and how long it will take. It appears only on a terminal
/// and only when the step takes more than two seconds, and leaves nothing behind.
class ProgressBar {
 public:
  explicit ProgressBar(std::string label);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void show(std::size_t done, std::size_t total);

 private:
  using Clock = std::chrono::steady_clock;

  std::string timeLeft(std::size_t done, std::size_t total) const;

  std::string label_;
  bool terminal_;
  bool visible_ = false;
  Clock::time_point start_;
  Clock::time_point next_;
};

}  // namespace visual_localization::apps

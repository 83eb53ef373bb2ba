#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "base/text.h"

namespace visual_localization {

/// A log of messages that may come with every image: one of each kind per period of wall time. Unlike the macros of
/// roscpp it belongs to one object, so that two localizers in one process do not silence each other. Thread-safe.
class ThrottledLog {
 public:
  enum class Severity : std::uint8_t { kWarning, kError };
  using Write = std::function<void(Severity severity, const std::string& text)>;

  explicit ThrottledLog(Write write, std::chrono::milliseconds period = std::chrono::seconds(5))
      : write_(std::move(write)), period_(period) {}

  /// `kind`: which messages count as the same one.
  void warn(const std::string& kind, const std::string& text) { add(Severity::kWarning, kind, text); }
  void error(const std::string& kind, const std::string& text) { add(Severity::kError, kind, text); }

 private:
  using Clock = std::chrono::steady_clock;

  void add(Severity severity, const std::string& kind, const std::string& text) {
    constexpr std::size_t kLongest = 2000;
    if (isDue(kind)) write_(severity, oneLine(text, kLongest));
  }

  bool isDue(const std::string& kind) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto now = Clock::now();
    const auto [entry, is_first] = last_.try_emplace(kind, now);
    if (!is_first && now - entry->second < period_) return false;
    entry->second = now;
    return true;
  }

  Write write_;
  std::chrono::milliseconds period_;
  std::mutex mutex_;
  std::map<std::string, Clock::time_point> last_;  ///< by kind
};

}  // namespace visual_localization

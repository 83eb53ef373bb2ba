#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <string>

namespace visual_localization {

/// Seconds from `from_ns` to `to_ns`.
inline double secondsBetween(std::int64_t from_ns, std::int64_t to_ns) {
  return static_cast<double>(to_ns - from_ns) * 1e-9;
}

/// A stamp as seconds with all nine decimals: a double would lose the last ones.
inline std::string secondsText(std::int64_t stamp_ns) {
  constexpr std::uint64_t kNanoseconds = 1'000'000'000;
  const auto bits = static_cast<std::uint64_t>(stamp_ns);
  const std::uint64_t magnitude = stamp_ns < 0 ? 0 - bits : bits;
  const std::string decimals = std::to_string(magnitude % kNanoseconds);
  return (stamp_ns < 0 ? "-" : "") + std::to_string(magnitude / kNanoseconds) + '.' +
         std::string(9 - decimals.size(), '0') + decimals;
}

/// How far apart the times of day of two stamps are, at most half a day.
inline std::int64_t apartInDay_ns(std::int64_t a_ns, std::int64_t b_ns) {
  constexpr std::int64_t kDay_ns = 86'400'000'000'000;
  const std::int64_t apart = std::abs(a_ns % kDay_ns - b_ns % kDay_ns) % kDay_ns;
  return std::min(apart, kDay_ns - apart);
}

/// Wall-clock time since it was made.
class Stopwatch {
 public:
  double elapsed_ms() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Processor time of the calling thread since it was made: other work on the machine hardly shows in it.
class CpuStopwatch {
 public:
  double elapsed_ms() const { return now_ms() - start_ms_; }

 private:
  static double now_ms() {
    timespec time{};
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
  }

  double start_ms_ = now_ms();
};

}  // namespace visual_localization

#pragma once

#include <ctime>

namespace visual_localization {

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

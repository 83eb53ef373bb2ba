#include "node/image_worker.h"

namespace visual_localization {

StampMonitor::Verdict StampMonitor::judge(std::int64_t stamp_ns) {
  lag_s_ = 0.0;
  if (!newest_ns_ || stamp_ns >= *newest_ns_) {
    newest_ns_ = stamp_ns;
    late_ns_.reset();
    return Verdict::kInOrder;
  }
  lag_s_ = static_cast<double>(*newest_ns_ - stamp_ns) * 1e-9;
  if (!late_ns_ || stamp_ns < *late_ns_) {
    late_ns_ = stamp_ns;
    return Verdict::kLate;
  }
  newest_ns_ = stamp_ns;
  late_ns_.reset();
  return Verdict::kWentBack;
}

}  // namespace visual_localization

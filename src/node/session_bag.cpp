#include "node/session_bag.h"

#include "base/files.h"
#include "base/text.h"

namespace visual_localization {

ros::Time receivedNow() {
  const ros::Time time = ros::Time::now();
  return time.isZero() ? ros::Time(ros::WallTime::now().toSec()) : time;
}

void SessionBag::sync() {
  try {
    bag_.sync();
    trouble_.clear();
  } catch (const FileError& error) {
    trouble_ = oneLine(error.what());
  }
}

/// Each sync writes the whole index again: after hours of small messages only when as much waits.
void SessionBag::syncSometimes() {
  constexpr std::uint64_t kSmallIndex_bytes = 64U << 10U;
  if (bag_.waiting() + kSmallIndex_bytes >= bag_.indexSize()) sync();
}

}  // namespace visual_localization

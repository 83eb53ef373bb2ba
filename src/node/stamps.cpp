#include "node/stamps.h"

#include <algorithm>
#include <cstdint>
#include <stdexcept>

#include "base/time.h"

namespace visual_localization {
namespace {

/// Local time that is taken for UTC is up to 14 hours ahead.
constexpr std::uint32_t kAhead_s = 86400;

std::int64_t inNanoseconds(const ros::Time& stamp) { return static_cast<std::int64_t>(stamp.toNSec()); }

ros::Time wallNow() {
  const ros::WallTime now = ros::WallTime::now();
  return {now.sec, now.nsec};
}

}  // namespace

ros::Time latestStamp(const ros::Time& now, const ros::Time& wall_now) {
  const ros::Time newest = std::max(now, wall_now);
  return {std::min(newest.sec, ros::TIME_MAX.sec - 2 * kAhead_s) + kAhead_s, 0};
}

std::string stampTrouble(const ros::Time& stamp) {
  const ros::Time now = ros::Time::now();
  const ros::Time wall_now = wallNow();
  if (stamp <= latestStamp(now, wall_now)) return {};
  return "its stamp " + secondsText(inNanoseconds(stamp)) + " s is more than a day after the present, " +
         secondsText(inNanoseconds(std::max(now, wall_now))) + " s, or at the end of what a stamp can hold";
}

void requireUsableStamp(const ros::Time& stamp) {
  const std::string trouble = stampTrouble(stamp);
  if (!trouble.empty()) throw std::invalid_argument(trouble);
}

ros::Time later(const ros::Time& stamp, double seconds) {
  try {
    return stamp + ros::Duration(seconds);
  } catch (const std::runtime_error&) {
    return ros::TIME_MAX;
  }
}

}  // namespace visual_localization

#include "ros/fix_message.h"

#include <cmath>

namespace visual_localization {
namespace {

/// Of a variance that the receiver claims; 0 when it claims none, or what cannot be.
double sigmaOf(const sensor_msgs::NavSatFix& message, double variance_m2) {
  if (message.position_covariance_type == sensor_msgs::NavSatFix::COVARIANCE_TYPE_UNKNOWN) return 0.0;
  return std::isfinite(variance_m2) && variance_m2 > 0.0 ? std::sqrt(variance_m2) : 0.0;
}

}  // namespace

Fix toFix(const sensor_msgs::NavSatFix& message, std::int64_t stamp_ns) {
  return {stamp_ns,
          {message.latitude, message.longitude, message.altitude},
          message.status.status >= sensor_msgs::NavSatStatus::STATUS_FIX,
          sigmaOf(message, 0.5 * (message.position_covariance[0] + message.position_covariance[4])),
          sigmaOf(message, message.position_covariance[8])};
}

}  // namespace visual_localization

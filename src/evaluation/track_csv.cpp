#include "evaluation/track_csv.h"

#include <cstdio>
#include <iomanip>
#include <limits>
#include <locale>
#include <sstream>

namespace visual_localization {
namespace {

/// Seconds with all nine decimals: a double would lose the last ones.
std::string seconds(std::int64_t stamp_ns) {
  constexpr std::int64_t kNanoseconds = 1000000000;
  std::ostringstream out;
  if (stamp_ns < 0) out << '-';
  const std::int64_t magnitude = stamp_ns < 0 ? -stamp_ns : stamp_ns;
  out << magnitude / kNanoseconds << '.' << std::setw(9) << std::setfill('0') << magnitude % kNanoseconds;
  return out.str();
}

}  // namespace

std::string trackCsvHeader() {
  return "stamp,east_m,north_m,yaw_rad,latitude_deg,longitude_deg,state,similarity,features,comparisons,extract_ms,"
         "match_ms,update_ms,swept\n";
}

std::string trackCsvRow(const Estimate& estimate) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(std::numeric_limits<double>::max_digits10);
  const PoseEstimate& pose = estimate.pose;
  out << seconds(estimate.stamp_ns) << ',' << pose.position_m.x() << ',' << pose.position_m.y() << ',' << pose.yaw_rad
      << ',' << pose.geodetic.latitude_deg << ',' << pose.geodetic.longitude_deg << ',' << toString(estimate.state)
      << ',' << estimate.tracked.best.similarity << ',' << toString(estimate.evidence.features) << ','
      << estimate.comparisons << ',' << estimate.image.extract_ms << ',' << estimate.image.match_ms << ','
      << estimate.update_ms << ',' << estimate.swept << '\n';
  return out.str();
}

}  // namespace visual_localization

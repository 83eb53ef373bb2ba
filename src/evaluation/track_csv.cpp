#include "evaluation/track_csv.h"

#include "base/text.h"
#include "base/time.h"

namespace visual_localization {

std::string trackCsvHeader() {
  return "stamp,east_m,north_m,yaw_rad,latitude_deg,longitude_deg,state,similarity,features,comparisons,extract_ms,"
         "match_ms,update_ms,source,inliers,reprojection_px,sigma_m,sigma_yaw_rad,swept\n";
}

std::string trackCsvRow(const Estimate& estimate) {
  std::ostringstream out = numberStream();
  const PoseEstimate& pose = estimate.pose;
  const std::optional<MetricPose>& metric = estimate.metric;
  out << secondsText(estimate.stamp_ns) << ',' << pose.position_m.x() << ',' << pose.position_m.y() << ','
      << pose.yaw_rad << ',' << pose.geodetic.latitude_deg << ',' << pose.geodetic.longitude_deg << ','
      << toString(estimate.state) << ',' << estimate.tracked.best.similarity << ','
      << toString(estimate.evidence.features) << ',' << estimate.comparisons << ',' << estimate.image.extract_ms << ','
      << estimate.image.match_ms << ',' << estimate.update_ms << ',' << toString(estimate.source) << ','
      << (metric ? metric->inliers : 0) << ',' << (metric ? metric->reprojection_px : 0.0) << ',' << estimate.sigma_m()
      << ',' << estimate.sigmaYaw_rad() << ',' << estimate.swept << '\n';
  return out.str();
}

}  // namespace visual_localization

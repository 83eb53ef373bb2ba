#include "visual_localization/localization/estimate.h"

#include <cmath>
#include <iomanip>
#include <sstream>

namespace visual_localization {

std::string toString(PoseSource source) {
  switch (source) {
    case PoseSource::kNone:
      return "NONE";
    case PoseSource::kPlace:
      return "PLACE";
    case PoseSource::kMetric:
      return "METRIC";
  }
  return "NONE";
}

double Estimate::sigma_m() const { return metric ? metric->sigma_m() : largerSigma(pose.covariance_m2); }

double Estimate::sigmaYaw_rad() const { return metric ? metric->sigmaYaw_rad() : std::sqrt(pose.yaw_variance_rad2); }

std::string Estimate::featuresName() const {
  return evidence.features == FeatureKind::kLocal ? image.local_features : "GLOBAL";
}

std::string Estimate::cameraTrouble() const {
  if (!camera_contradicted) return "";
  std::ostringstream text;
  text << "the focal length estimated from the images is " << std::fixed << std::setprecision(1) << 100.0 * focal_scale
       << " % of the calibration's: no metric poses";
  if (other_lens) text << "; the map's images were seen through another lens, so that its places are off";
  return text.str();
}

}  // namespace visual_localization

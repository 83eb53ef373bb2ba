#include "visual_localization/localization/estimate.h"

#include <cmath>
#include <iomanip>
#include <sstream>

#include "localization/covariance.h"

namespace visual_localization {

double Estimate::sigma_m() const { return metric ? metric->sigma_m() : largerSigma(pose.covariance_m2); }

double Estimate::sigmaYaw_rad() const { return metric ? metric->sigmaYaw_rad() : std::sqrt(pose.yaw_variance_rad2); }

std::string Estimate::cameraTrouble() const {
  if (!camera_contradicted) return "";
  std::ostringstream text;
  text << "the images ask for " << std::fixed << std::setprecision(1) << 100.0 * focal_scale
       << " % of the calibration's focal length: no metric poses";
  return text.str();
}

}  // namespace visual_localization

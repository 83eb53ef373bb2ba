#include "visual_localization/localization/estimate.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>

namespace visual_localization {
namespace {

/// Of the horizontal position.
double largerSigma_m(const MetricPose::Covariance& covariance) { return largerSigma(covariance.topLeftCorner<2, 2>()); }

double yawSigma_rad(const MetricPose::Covariance& covariance) { return std::sqrt(std::max(0.0, covariance(5, 5))); }

}  // namespace

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

void MetricConfig::declare(ParameterVisitor& visitor) {
  visitor.choice({"pose_source", "",
                  "metric: solve the pose from landmarks where the map has them; place: that of "
                  "training images, as in the papers"},
                 pose_source, {"metric", "place"});
  visitor.integer({"metric/min_inliers", "1", "a pose on fewer landmarks is not believed"}, min_inliers, 6, 10000);
  visitor.integer({"metric/min_inliers_tracking", "1",
                   "TRACKING needs so many inliers, those of the poses before that this one follows included"},
                  min_inliers_tracking, 6, 1000000);
}

double MetricPose::sigma_m() const { return largerSigma_m(covariance); }

double MetricPose::sigmaYaw_rad() const { return yawSigma_rad(covariance); }

double MetricPose::mapSigma_m() const { return largerSigma_m(map_covariance); }

double MetricPose::mapSigmaYaw_rad() const { return yawSigma_rad(map_covariance); }

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
  return text.str();
}

}  // namespace visual_localization

#include "visual_localization/localization/metric_pose.h"

#include <algorithm>
#include <cmath>

namespace visual_localization {
namespace {

/// Of the horizontal position.
double largerSigma_m(const MetricPose::Covariance& covariance) { return largerSigma(covariance.topLeftCorner<2, 2>()); }

double yawSigma_rad(const MetricPose::Covariance& covariance) { return std::sqrt(std::max(0.0, covariance(5, 5))); }

}  // namespace

void MetricConfig::declare(ParameterVisitor& visitor) {
  visitor.choice({"pose_source", "",
                  "metric: solve the pose from landmarks where the map has them; place: that of "
                  "training images, as in the papers"},
                 pose_source, {"metric", "place"});
  visitor.integer({"metric/min_inliers_tracking", "1",
                   "TRACKING needs so many inliers, those of the poses before that this one follows included"},
                  min_inliers_tracking, 6, 1000000);
}

double MetricPose::sigma_m() const { return largerSigma_m(covariance); }

double MetricPose::sigmaYaw_rad() const { return yawSigma_rad(covariance); }

double MetricPose::mapSigma_m() const { return largerSigma_m(map_covariance); }

double MetricPose::mapSigmaYaw_rad() const { return yawSigma_rad(map_covariance); }

}  // namespace visual_localization

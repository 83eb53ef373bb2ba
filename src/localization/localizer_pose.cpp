// Which pose the localizer answers with.

#include "localization/pose_verifier.h"
#include "visual_localization/localization/localizer.h"
#include "visual_localization/localization/path_interpolation.h"

namespace visual_localization {
namespace {

/// Of the positions of a session, by errors of its receiver that last.
double mapVariance_m2(const TrainingMap& map, std::size_t image) {
  const auto& fixes = map.header().sessions[static_cast<std::size_t>(map.pose(image).session)].fixes;
  return fixes ? fixes->sigma_m * fixes->sigma_m : 0.0;
}

}  // namespace

/// The solved pose; without one where the motion so far leads to, if the tracker is not elsewhere; or what the tracker
/// has. Poses by a calibration that the images contradict lead nowhere.
void Localizer::choosePose(Estimate& estimate) {
  if (estimate.metric) {
    estimate.pose = poseOf(*estimate.metric);
    estimate.source = PoseSource::kMetric;
    return;
  }
  estimate.pose = poseOf(estimate.tracked, estimate.state);
  const bool probable = estimate.evidence.probability && estimate.state == LocalizationState::kTracking;
  const bool placed = estimate.tracked.best.recognised || probable;
  estimate.source = placed ? PoseSource::kPlace : PoseSource::kNone;
  const bool follows_poses = isMetric() && !verifier_->focal().contradicts();
  const auto predicted = follows_poses ? verifier_->predictor().predicted() : std::nullopt;
  if (!predicted) return;
  const double apart_m = (predicted->position_m - estimate.pose.position_m).norm();
  const bool knows_better = predicted->by_odometry && !estimate.tracked.best.recognised;
  if (apart_m > config_.state.max_distance_m && !knows_better) return;
  estimate.pose.position_m = predicted->position_m;
  estimate.pose.yaw_rad = predicted->yaw_rad;
  estimate.pose.covariance_m2 = predicted->covariance_m2;
  estimate.pose.yaw_variance_rad2 = predicted->yaw_variance_rad2;
  estimate.pose.geodetic = map_->frame().toGeodetic(predicted->position_m);
  estimate.source = PoseSource::kNone;
}

/// Map and pose together.
PoseEstimate Localizer::poseOf(const MetricPose& metric) const {
  PoseEstimate pose;
  pose.position_m = metric.base.translation().head<2>();
  pose.yaw_rad = yawOf(metric.base);
  const MetricPose::Covariance covariance = metric.covariance + metric.map_covariance;
  pose.covariance_m2 = covariance.topLeftCorner<2, 2>();
  pose.yaw_variance_rad2 = covariance(5, 5);
  pose.geodetic = map_->frame().toGeodetic(pose.position_m);
  return pose;
}

/// While the images confirm the position the covariance is that of its mode; otherwise that of the whole cloud
/// about it, so that nothing downstream trusts a guess.
PoseEstimate Localizer::poseOf(const TrackerEstimate& tracked, LocalizationState state) {
  constexpr double kFloor_m2 = LocalizerConfig::kMinPositionStd_m * LocalizerConfig::kMinPositionStd_m;
  const bool recognised = tracked.best.recognised && tracked.best_distance_m <= config_.state.max_distance_m;
  PoseEstimate pose;
  pose.position_m = positionOf_m(tracked, recognised);
  pose.covariance_m2 = state == LocalizationState::kTracking ? tracked.mode_covariance_m2 : tracked.cloud_covariance_m2;
  pose.covariance_m2 += (kFloor_m2 + mapVariance_m2(*map_, tracked.best_image)) * Eigen::Matrix2d::Identity();
  const Heading heading =
      headingAt(*map_, pose.position_m, recognised ? std::optional(tracked.best_image) : std::nullopt, neighbours_);
  pose.yaw_rad = heading.yaw_rad;
  pose.yaw_variance_rad2 = heading.variance_rad2 + LocalizerConfig::kMinYawStd_rad * LocalizerConfig::kMinYawStd_rad;
  pose.geodetic = map_->frame().toGeodetic(pose.position_m);
  return pose;
}

/// The position by the sizes of features is exact in the same light and poor beside the path, that of the posterior the
/// other way round. Their errors have different causes: the mean of both is often better than either.
Eigen::Vector2d Localizer::positionOf_m(const TrackerEstimate& tracked, bool recognised) {
  const bool by_size = config_.estimate == "interpolated" && scores_.kind() == FeatureKind::kLocal;
  if (!recognised || !by_size) return tracked.position_m;
  const Eigen::Vector2d sized_m = interpolateOnPath(*map_, scores_, tracked.best_image);
  return tracker_->posterior() == nullptr ? sized_m : 0.5 * (sized_m + tracked.position_m);
}

}  // namespace visual_localization

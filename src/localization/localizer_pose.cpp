// Which pose the localizer answers with.

#include <algorithm>
#include <cmath>

#include "localization/place_filter.h"
#include "localization/pose_verifier.h"
#include "visual_localization/localization/localizer.h"
#include "visual_localization/localization/path_interpolation.h"

namespace visual_localization {
namespace {

/// Of the positions of a session, by errors of its receiver that last.
double receiverVariance_m2(const TrainingMap& map, std::size_t image) {
  const auto& fixes = map.header().sessions[static_cast<std::size_t>(map.pose(image).session)].fixes;
  return fixes ? fixes->sigma_m * fixes->sigma_m : 0.0;
}

}  // namespace

/// Of a position by what looks alike, beside the posterior's: no map is known better than to its spacing.
double Localizer::placeVariance_m2(std::size_t image) const {
  const double floor_m = std::min(LocalizerConfig::kMinPositionStd_m, posterior().spacing_m());
  return floor_m * floor_m + receiverVariance_m2(*map_, image);
}

/// How far from a published position the robot may be for it to be right: as far as training images look alike, or as
/// published sigmas say.
double Localizer::hereRadius_m(std::size_t image) const {
  constexpr double kSigmas = 3.0;
  return std::max(posterior().around_m(), kSigmas * std::sqrt(placeVariance_m2(image)));
}

/// Of the position that is published if the image confirms it.
double Localizer::claimedSigma_m(const TrackerEstimate& tracked, const std::optional<MetricPose>& metric,
                                 const std::optional<PredictedPose>& predicted) const {
  if (metric) return largerSigma((metric->covariance + metric->map_covariance).topLeftCorner<2, 2>());
  if (predicted) return largerSigma(predicted->covariance_m2);
  return largerSigma(tracked.mode_covariance_m2 + placeVariance_m2(tracked.best_image) * Eigen::Matrix2d::Identity());
}

/// The solved pose; without one where the verified motion leads to, whatever looks alike elsewhere; or what the tracker
/// has.
void Localizer::choosePose(Estimate& estimate, const std::optional<PredictedPose>& predicted) {
  if (estimate.metric) {
    estimate.pose = poseOf(*estimate.metric);
    estimate.source = PoseSource::kMetric;
    return;
  }
  estimate.pose = poseOf(estimate.tracked, estimate.state);
  const bool probable = estimate.evidence.probability && estimate.state == LocalizationState::kTracking;
  const bool placed = estimate.tracked.best.recognised || probable;
  estimate.source = placed ? PoseSource::kPlace : PoseSource::kNone;
  if (!predicted) return;
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
  PoseEstimate pose;
  pose.position_m = placeOf_m(tracked);
  pose.covariance_m2 = state == LocalizationState::kTracking ? tracked.mode_covariance_m2 : tracked.cloud_covariance_m2;
  pose.covariance_m2 += placeVariance_m2(tracked.best_image) * Eigen::Matrix2d::Identity();
  const Heading heading = headingAt(
      *map_, pose.position_m, isRecognised(tracked) ? std::optional(tracked.best_image) : std::nullopt, neighbours_);
  pose.yaw_rad = heading.yaw_rad;
  pose.yaw_variance_rad2 = heading.variance_rad2 + LocalizerConfig::kMinYawStd_rad * LocalizerConfig::kMinYawStd_rad;
  pose.geodetic = map_->frame().toGeodetic(pose.position_m);
  return pose;
}

bool Localizer::isRecognised(const TrackerEstimate& tracked) const {
  return tracked.best.recognised && tracked.best_distance_m <= config_.state.max_distance_m;
}

/// The position by the sizes of features is exact in the same light and poor beside the path, that of the posterior the
/// other way round. Their errors have different causes: the mean of both is often better than either.
Eigen::Vector2d Localizer::placeOf_m(const TrackerEstimate& tracked) {
  const bool by_size = config_.estimate == "interpolated" && scores_.kind() == FeatureKind::kLocal;
  if (!isRecognised(tracked) || !by_size) return tracked.position_m;
  const Eigen::Vector2d sized_m = interpolateOnPath(*map_, scores_, tracked.best_image);
  return tracker_->posterior() == nullptr ? sized_m : 0.5 * (sized_m + tracked.position_m);
}

}  // namespace visual_localization

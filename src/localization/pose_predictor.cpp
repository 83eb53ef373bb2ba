#include "localization/pose_predictor.h"

#include <cmath>

#include <Eigen/Geometry>

#include "base/numbers.h"
#include "base/time.h"

namespace visual_localization {
namespace {

constexpr double kTurn = 0.5;            ///< how far off the straight way a robot may be, as a share of the way
constexpr double kUnknownWay_m = 1.0;    ///< the same where one pose tells no speed
constexpr double kShortWay_m = 10.0;     ///< after a longer one a robot may be anywhere
constexpr double kTurn_rad_per_m = 0.1;  ///< standard deviation of how much it turns on the way
constexpr double kSlipped_m = 0.3;       ///< odometry that is off by more, beside its own uncertainty, is wrong
constexpr double kSlipped_rad = 0.3;
constexpr double kBeside_m = 5.0;  ///< landmarks of a thing that was moved are no farther from where they were
constexpr std::size_t kImagesOfDistrust = 10;

/// Where odometry leads from `last`. A wrong heading moves it aside, the more the farther it goes.
PredictedPose predictedBy(const MetricPose& last, const OdometryIncrement& way, const OdometryConfig& config) {
  const MetricPose::Covariance covariance = last.covariance + last.map_covariance;
  const double turn_rad = config.turn_sigma_rad_m * way.distance_m;
  const Eigen::Vector2d way_m = Eigen::Rotation2Dd(yawOf(last.base)) * way.translation_m;
  const Eigen::Vector2d aside_m(-way_m.y(), way_m.x());
  const double yaw_variance = covariance(5, 5) + 0.25 * turn_rad * turn_rad;
  PredictedPose prediction;
  prediction.position_m = last.base.translation().head<2>() + way_m;
  prediction.yaw_rad = std::remainder(yawOf(last.base) + way.rotation_rad, 2.0 * kPi);
  prediction.sigma_m = config.distance_sigma * way.distance_m;
  prediction.covariance_m2 = covariance.topLeftCorner<2, 2>() +
                             prediction.sigma_m * prediction.sigma_m * Eigen::Matrix2d::Identity() +
                             yaw_variance * aside_m * aside_m.transpose();
  prediction.yaw_variance_rad2 = covariance(5, 5) + turn_rad * turn_rad;
  prediction.by_odometry = true;
  return prediction;
}

}  // namespace

void PosePredictor::startImage(std::int64_t stamp_ns) {
  ++images_since_;
  stamp_ns_ = stamp_ns;
}

void PosePredictor::useOdometry(const OdometryTrack& track, const OdometryConfig& config) {
  odometry_ = &track;
  odometry_config_ = config;
}

void PosePredictor::doubtMotion() {
  if (last_) last_->velocity_holds = false;
}

bool PosePredictor::add(const MetricPose& pose) {
  const std::optional<bool> odometry_agrees = odometryAgrees(pose);
  const bool elsewhere = isElsewhere(pose, odometry_agrees);
  if (odometry_agrees) judgeOdometry(*odometry_agrees);
  Known known{stamp_ns_, pose, {}, 0.0, true};
  if (last_ && last_->velocity_holds) {
    const double elapsed_s = secondsBetween(last_->stamp_ns, stamp_ns_);
    if (elapsed_s > 0.0 && elapsed_s <= kMaxGap_s) {
      known.velocity_mps = (pose.base.translation() - last_->pose.base.translation()).head<2>() / elapsed_s;
      known.turned_rad = angleDifference(yawOf(last_->pose.base), yawOf(pose.base));
      if (isPredicted(pose)) speed_mps_ = known.velocity_mps->norm();  // two that agree
    }
  }
  last_ = known;
  images_since_ = 0;
  return !elsewhere;
}

std::optional<PredictedPose> PosePredictor::predicted() const {
  const std::optional<PredictedPose> prediction = byOdometry();
  return prediction ? prediction : byVelocity();
}

std::optional<PredictedPose> PosePredictor::byOdometry() const {
  if (!last_ || odometry_ == nullptr || distrust_ > 0) return std::nullopt;
  const auto way = odometry_->between(last_->stamp_ns, stamp_ns_);
  if (!way || way->distance_m > odometry_config_.max_distance_m) return std::nullopt;
  return predictedBy(last_->pose, *way, odometry_config_);
}

std::optional<PredictedPose> PosePredictor::byVelocity() const {
  if (!last_ || !last_->velocity_holds) return std::nullopt;
  const double elapsed_s = secondsBetween(last_->stamp_ns, stamp_ns_);
  if (!(elapsed_s >= 0.0 && elapsed_s <= kMaxGap_s)) return std::nullopt;
  const MetricPose& last = last_->pose;
  const Eigen::Vector2d way_m = last_->velocity_mps.value_or(Eigen::Vector2d::Zero()) * elapsed_s;
  const MetricPose::Covariance covariance = last.covariance + last.map_covariance;
  PredictedPose prediction;
  prediction.position_m = last.base.translation().head<2>() + way_m;
  prediction.yaw_rad = yawOf(last.base);
  prediction.sigma_m = last_->velocity_mps ? kTurn * way_m.norm() : kUnknownWay_m;
  prediction.covariance_m2 =
      covariance.topLeftCorner<2, 2>() + prediction.sigma_m * prediction.sigma_m * Eigen::Matrix2d::Identity();
  const double turn_rad = kTurn_rad_per_m * way_m.norm();
  prediction.yaw_variance_rad2 = covariance(5, 5) + turn_rad * turn_rad;
  return prediction;
}

bool PosePredictor::isPredicted(const MetricPose& pose) const {
  const auto agrees = [&](const std::optional<PredictedPose>& expected) {
    return expected && (pose.base.translation().head<2>() - expected->position_m).norm() <=
                           config_.max_prediction_error_m + expected->sigma_m + 2.0 * pose.sigma_m();
  };
  std::optional<PredictedPose> by_velocity = byVelocity();
  if (agrees(byOdometry()) || agrees(by_velocity)) return true;
  if (!by_velocity) return false;
  const Eigen::Vector2d last_m = last_->pose.base.translation().head<2>();
  const double turned_rad = angleDifference(yawOf(last_->pose.base), yawOf(pose.base));
  const Eigen::Rotation2Dd along_arc(0.5 * (last_->turned_rad + turned_rad));
  by_velocity->position_m = last_m + along_arc * (by_velocity->position_m - last_m);
  return agrees(by_velocity);
}

bool PosePredictor::follows(const MetricPose& pose) const {
  if (isPredicted(pose)) return true;
  if (!last_ || !speed_mps_) return false;
  const double way_m = *speed_mps_ * secondsBetween(last_->stamp_ns, stamp_ns_);
  if (!(way_m >= 0.0 && way_m <= kShortWay_m)) return false;
  const double driven_m = (pose.base.translation() - last_->pose.base.translation()).head<2>().norm();
  return driven_m <= config_.max_prediction_error_m + (1.0 + kTurn) * way_m;
}

bool PosePredictor::isBesidePrediction(const MetricPose& pose) const {
  if (images_since_ != 1 || !last_) return false;
  const std::optional<PredictedPose> expected = predicted();
  if (!expected || !(expected->by_odometry || last_->velocity_mps) || odometryAgrees(pose).value_or(false))
    return false;
  return !isPredicted(pose) && (pose.base.translation().head<2>() - expected->position_m).norm() < kBeside_m;
}

/// Whether odometry since the last verified pose leads to this one; nothing when it does not know. The map's own error
/// is the same for both.
std::optional<bool> PosePredictor::odometryAgrees(const MetricPose& pose) const {
  if (!last_ || odometry_ == nullptr) return std::nullopt;
  const auto way = odometry_->between(last_->stamp_ns, stamp_ns_);
  if (!way) return std::nullopt;
  MetricPose last = last_->pose;
  last.map_covariance.setZero();
  const PredictedPose expected = predictedBy(last, *way, odometry_config_);
  const double off_m = (pose.base.translation().head<2>() - expected.position_m).norm();
  const double turned_rad = std::abs(angleDifference(expected.yaw_rad, yawOf(pose.base)));
  return off_m <= kSlipped_m + 3.0 * largerSigma(expected.covariance_m2) && turned_rad <= kSlipped_rad;
}

/// Wheels that slip or a robot that was carried: what odometry says is worth nothing until it agrees again for a while.
void PosePredictor::judgeOdometry(bool agrees) {
  if (!agrees) {
    distrust_ = kImagesOfDistrust;
  } else if (distrust_ > 0) {
    --distrust_;
  }
}

/// Odometry that is believed leads elsewhere: the robot was carried, the wheels have slipped while nothing was seen, or
/// this is the twin of the place. The first two stay, and a few more poses along the motion tell.
bool PosePredictor::isElsewhere(const MetricPose& pose, std::optional<bool> odometry_agrees) {
  const bool predicted = isPredicted(pose);
  if (byOdometry() && !odometry_agrees.value_or(true) && !predicted) {
    elsewhere_ = kImagesOfDistrust;
  } else if (!odometry_agrees && !byVelocity()) {
    elsewhere_ = 0;  // nobody knows any more how it came here
  } else if (elsewhere_ > 0 && (predicted || odometry_agrees.value_or(false))) {
    --elsewhere_;
  }
  return elsewhere_ > 0;
}

}  // namespace visual_localization

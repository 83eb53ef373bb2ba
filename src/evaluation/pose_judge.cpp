#include "evaluation/pose_judge.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "base/angles.h"
#include "base/text.h"
#include "base/time.h"

namespace visual_localization {
namespace {

constexpr double kAcceleration_m_s2 = 0.2;  ///< standard deviation, per axis, for a second
constexpr double kSpeed_m_s = 10.0;         ///< of a robot that nothing is known of
constexpr double kLongestPause_s = 10.0;
constexpr double kGate = 30.0;  ///< squared Mahalanobis distance: beyond, it is another place

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
constexpr double kMostNees = 1e9;  ///< of a covariance that leaves no room for an error

float degreesApart(double yaw_rad, double other_rad) {
  return static_cast<float>(std::abs(angleDifference(other_rad, yaw_rad)) * 180.0 / kPi);
}

float neesOf(const Eigen::Vector2d& error_m, const Eigen::Matrix2d& covariance_m2) {
  const double nees = error_m.dot(covariance_m2.inverse() * error_m);
  return static_cast<float>(nees >= 0.0 ? std::min(nees, kMostNees) : kMostNees);
}

std::string tumLine(std::int64_t stamp_ns, const Eigen::Vector3d& position_m, const Eigen::Quaterniond& rotation) {
  std::ostringstream out = numberStream();
  out << secondsText(stamp_ns) << ' ' << position_m.x() << ' ' << position_m.y() << ' ' << position_m.z() << ' '
      << rotation.x() << ' ' << rotation.y() << ' ' << rotation.z() << ' ' << rotation.w();
  return out.str();
}

}  // namespace

void VelocityFilter::add(std::int64_t stamp_ns, const Eigen::Vector2d& position_m,
                         const Eigen::Matrix2d& covariance_m2) {
  const double elapsed_s = stamp_ns_ ? secondsBetween(*stamp_ns_, stamp_ns) : -1.0;
  stamp_ns_ = stamp_ns;
  if (!(elapsed_s > 0.0 && elapsed_s <= kLongestPause_s)) return begin(position_m, covariance_m2);
  predict(elapsed_s);
  const Eigen::Vector2d innovation_m = position_m - state_.head<2>();
  const Eigen::Matrix2d inverse = (covariance_.topLeftCorner<2, 2>() + covariance_m2).inverse();
  if (!(innovation_m.dot(inverse * innovation_m) <= kGate)) return begin(position_m, covariance_m2);
  const Eigen::Matrix<double, 4, 2> gain = covariance_.leftCols<2>() * inverse;
  state_ += gain * innovation_m;
  covariance_ -= (gain * covariance_.topRows<2>()).eval();
}

void VelocityFilter::begin(const Eigen::Vector2d& position_m, const Eigen::Matrix2d& covariance_m2) {
  state_ << position_m, Eigen::Vector2d::Zero();
  covariance_.setZero();
  covariance_.topLeftCorner<2, 2>() = covariance_m2;
  covariance_.bottomRightCorner<2, 2>() = kSpeed_m_s * kSpeed_m_s * Eigen::Matrix2d::Identity();
}

/// White acceleration between two images (Bar-Shalom et al., Estimation with Applications to Tracking and Navigation,
/// section 6.2.2: continuous white noise).
void VelocityFilter::predict(double elapsed_s) {
  Eigen::Matrix4d motion = Eigen::Matrix4d::Identity();
  motion.topRightCorner<2, 2>() = elapsed_s * Eigen::Matrix2d::Identity();
  const double density = kAcceleration_m_s2 * kAcceleration_m_s2;
  const Eigen::Matrix2d identity = Eigen::Matrix2d::Identity();
  Eigen::Matrix4d noise;
  noise << identity * elapsed_s * elapsed_s * elapsed_s / 3.0, identity * elapsed_s * elapsed_s / 2.0,
      identity * elapsed_s * elapsed_s / 2.0, identity * elapsed_s;
  state_ = motion * state_;
  covariance_ = motion * covariance_ * motion.transpose() + density * noise;
}

void judgePose(const Estimate& estimate, const Eigen::Vector2d& truth_m, const std::optional<double>& true_yaw_rad,
               const std::optional<MapError>& map_error, StepRecord& step) {
  const PoseEstimate& pose = estimate.pose;
  const Eigen::Vector2d error_m = pose.position_m - truth_m;
  if (true_yaw_rad) step.heading_err_deg = degreesApart(pose.yaw_rad, *true_yaw_rad);
  const bool metric = estimate.source == PoseSource::kMetric;
  if (metric || estimate.state == LocalizationState::kTracking) step.nees = neesOf(error_m, pose.covariance_m2);
  if (!map_error) return;
  if (true_yaw_rad && map_error->yaw_rad) {
    step.relative.heading_deg = degreesApart(pose.yaw_rad, *true_yaw_rad + *map_error->yaw_rad);
  }
  if (metric && estimate.metric) {
    step.relative.nees = neesOf(error_m - map_error->position_m, estimate.metric->covariance.topLeftCorner<2, 2>());
  }
}

void judgeFiltered(const Estimate& estimate, const Eigen::Vector2d& truth_m, const std::optional<MapError>& map_error,
                   VelocityFilter& filter, StepRecord& step) {
  if (!estimate.metric || estimate.state != LocalizationState::kTracking) return;
  const MetricPose& metric = *estimate.metric;
  filter.add(estimate.stamp_ns, estimate.pose.position_m, metric.covariance.topLeftCorner<2, 2>());
  const Eigen::Vector2d error_m = filter.position_m() - truth_m;
  const Eigen::Matrix2d of_map_m2 = metric.map_covariance.topLeftCorner<2, 2>();
  step.filtered = {static_cast<float>(error_m.norm()), kUnknown, neesOf(error_m, filter.covariance_m2() + of_map_m2)};
  if (!map_error) return;
  const Eigen::Vector2d relative_m = error_m - map_error->position_m;
  step.relative_filtered = {static_cast<float>(relative_m.norm()), kUnknown,
                            neesOf(relative_m, filter.covariance_m2())};
}

std::string tumLine(const Estimate& estimate) {
  if (!estimate.metric) return tumLine(estimate.stamp_ns, estimate.pose.position_m, estimate.pose.yaw_rad);
  const Eigen::Isometry3d& base = estimate.metric->base;
  return tumLine(estimate.stamp_ns, base.translation(), Eigen::Quaterniond(base.linear()));
}

std::string tumLine(std::int64_t stamp_ns, const Eigen::Vector2d& position_m, double yaw_rad) {
  const Eigen::Quaterniond rotation(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()));
  return tumLine(stamp_ns, Eigen::Vector3d(position_m.x(), position_m.y(), 0.0), rotation);
}

}  // namespace visual_localization

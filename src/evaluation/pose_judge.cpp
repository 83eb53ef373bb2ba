#include "evaluation/pose_judge.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include "base/angles.h"
#include "base/text.h"
#include "base/time.h"

namespace visual_localization {
namespace {

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

#include "evaluation/metrics.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "base/numbers.h"
#include "base/text.h"
#include "base/time.h"

namespace visual_localization {
namespace {

/// NaN without any.
double share(std::size_t part, std::size_t rest) {
  return static_cast<double>(part) / static_cast<double>(part + rest);
}

constexpr double kInside95 = 5.991464547107979;  // chi squared with two degrees of freedom

/// NaN without any.
template <class Sum>
double mean(Sum sum, std::size_t count) {
  return static_cast<double>(sum) / static_cast<double>(count);
}

}  // namespace

ErrorStatistics summarise(std::vector<double> errors_m) {
  ErrorStatistics statistics;
  if (errors_m.empty()) return statistics;
  const auto count = static_cast<double>(errors_m.size());
  std::sort(errors_m.begin(), errors_m.end());
  statistics.count = errors_m.size();
  statistics.mean_m = std::accumulate(errors_m.begin(), errors_m.end(), 0.0) / count;
  statistics.median_m = median(errors_m);
  const auto near = std::lower_bound(errors_m.begin(), errors_m.end(), kRight_m) - errors_m.begin();
  statistics.within_5m = static_cast<double>(near) / count;
  return statistics;
}

double recallAtPrecision(std::vector<Decision> decisions, double precision) {
  if (!(precision >= 0.0 && precision <= 1.0)) {
    throw std::invalid_argument("precision " + std::to_string(precision) + " is not in [0, 1]");
  }
  const auto unsure = [](const Decision& decision) { return std::isnan(decision.confidence); };
  if (std::any_of(decisions.begin(), decisions.end(), unsure)) throw std::invalid_argument("a confidence is NaN");
  std::sort(decisions.begin(), decisions.end(),
            [](const Decision& a, const Decision& b) { return a.confidence > b.confidence; });
  const std::size_t all = decisions.size();
  std::size_t correct = 0;
  std::size_t recalled = 0;
  for (std::size_t accepted = 1; accepted <= all; ++accepted) {
    correct += decisions[accepted - 1].correct ? 1 : 0;
    const bool tied = accepted < all && decisions[accepted].confidence == decisions[accepted - 1].confidence;
    if (!tied && static_cast<double>(correct) / static_cast<double>(accepted) >= precision) recalled = correct;
  }
  return all == 0 ? 0.0 : static_cast<double>(recalled) / static_cast<double>(all);
}

void Trust::add(const StepRecord& step) {
  if (std::isnan(step.error_m) || step.state == LocalizationState::kNoMap) return;
  const bool right = static_cast<double>(step.error_m) < kRight_m;
  if (step.state == LocalizationState::kTracking) {
    ++(right ? tracking_right : tracking_wrong);
  } else {
    ++(right ? lost_wrong : lost_right);
  }
  if (step.state == LocalizationState::kOffMap) {
    ++(step.off_map ? off_map_right : off_map_wrong);
  } else if (step.off_map) {
    ++off_map_missed;
  }
}

Trust& Trust::operator+=(const Trust& other) {
  tracking_right += other.tracking_right;
  tracking_wrong += other.tracking_wrong;
  lost_right += other.lost_right;
  lost_wrong += other.lost_wrong;
  off_map_right += other.off_map_right;
  off_map_wrong += other.off_map_wrong;
  off_map_missed += other.off_map_missed;
  return *this;
}

double Trust::trackingShare() const { return share(tracking_right + tracking_wrong, lost_right + lost_wrong); }
double Trust::wrongTracking() const { return share(tracking_wrong, tracking_right); }
double Trust::lostPrecision() const { return share(lost_right, lost_wrong); }
double Trust::lostRecall() const { return share(lost_right, tracking_wrong); }
double Trust::offMapPrecision() const { return share(off_map_right, off_map_wrong); }
double Trust::offMapRecall() const { return share(off_map_right, off_map_missed); }

void Claims::add(const StepRecord& step) {
  if (std::isnan(step.error_m)) return;
  ++images;
  right += step.right ? 1 : 0;
  if (step.state == LocalizationState::kTracking) {
    ++tracking;
    tracking_wrong += step.wrong ? 1 : 0;
  }
  if (std::isnan(step.probability)) return;
  const auto probability = static_cast<double>(step.probability);
  const auto behind = std::upper_bound(kBins.begin() + 1, kBins.end(), probability);
  Bin& bin = bins[static_cast<std::size_t>(behind - kBins.begin()) - 1];
  ++bin.images;
  bin.wrong += step.wrong ? 1 : 0;
  bin.probability += probability;
}

Claims& Claims::operator+=(const Claims& other) {
  images += other.images;
  right += other.right;
  tracking += other.tracking;
  tracking_wrong += other.tracking_wrong;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    bins[i].images += other.bins[i].images;
    bins[i].wrong += other.bins[i].wrong;
    bins[i].probability += other.bins[i].probability;
  }
  return *this;
}

double Claims::rightShare() const { return mean(right, images); }
double Claims::wrongClaims() const { return mean(tracking_wrong, tracking); }

void PoseErrors::add(const StepErrors& errors) {
  const auto position = static_cast<double>(errors.position_m);
  if (std::isnan(position)) return;
  ++positions;
  position_m += position;
  if (!std::isnan(errors.nees)) {
    ++claims;
    inside_95 += static_cast<double>(errors.nees) <= kInside95 ? 1 : 0;
    nees += static_cast<double>(errors.nees);
  }
  const auto heading = static_cast<double>(errors.heading_deg);
  if (std::isnan(heading)) return;
  ++headings;
  heading_deg += heading;
  for (std::size_t i = 0; i < kRecall.size(); ++i) {
    recalled[i] += position <= kRecall[i].position_m && heading <= kRecall[i].heading_deg ? 1 : 0;
  }
}

PoseErrors& PoseErrors::operator+=(const PoseErrors& other) {
  positions += other.positions;
  position_m += other.position_m;
  headings += other.headings;
  heading_deg += other.heading_deg;
  for (std::size_t i = 0; i < recalled.size(); ++i) recalled[i] += other.recalled[i];
  claims += other.claims;
  inside_95 += other.inside_95;
  nees += other.nees;
  return *this;
}

double PoseErrors::meanPosition_m() const { return mean(position_m, positions); }
double PoseErrors::meanHeading_deg() const { return mean(heading_deg, headings); }
double PoseErrors::recall(std::size_t threshold) const { return mean(recalled.at(threshold), headings); }
double PoseErrors::insideShare() const { return mean(inside_95, claims); }
double PoseErrors::meanNees() const { return mean(nees, claims); }

void PoseFigures::add(const StepRecord& step) {
  absolute.add({step.error_m, step.heading_err_deg, step.nees});
  relative.add(step.relative);
  filtered.add(step.filtered);
  relative_filtered.add(step.relative_filtered);
  if (std::isnan(step.error_m) || step.state == LocalizationState::kNoMap) return;
  ++images;
  metric += step.source == PoseSource::kMetric ? 1 : 0;
  if (step.state != LocalizationState::kTracking) return;
  wrong_1m += step.error_m > 1.0F ? 1 : 0;
  wrong_5m += step.error_m > 5.0F ? 1 : 0;
}

PoseFigures& PoseFigures::operator+=(const PoseFigures& other) {
  images += other.images;
  metric += other.metric;
  wrong_1m += other.wrong_1m;
  wrong_5m += other.wrong_5m;
  absolute += other.absolute;
  relative += other.relative;
  filtered += other.filtered;
  relative_filtered += other.relative_filtered;
  return *this;
}

double PoseFigures::metricShare() const { return mean(metric, images); }
double PoseFigures::wrong1mShare() const { return mean(wrong_1m, images); }
double PoseFigures::wrong5mShare() const { return mean(wrong_5m, images); }

namespace {

constexpr double kAcceleration_m_s2 = 0.2;  ///< standard deviation, per axis, for a second
constexpr double kSpeed_m_s = 10.0;         ///< of a robot that nothing is known of
constexpr double kLongestPause_s = 10.0;
constexpr double kGate = 30.0;  ///< squared Mahalanobis distance: beyond, it is another place

constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
constexpr double kMostNees = 1e9;  ///< of a covariance that leaves no room for an error

float degreesApart(double yaw_rad, double other_rad) {
  return static_cast<float>(toDegrees(std::abs(angleDifference(other_rad, yaw_rad))));
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

/// Continuous white noise acceleration (Bar-Shalom et al., Estimation with Applications to Tracking and Navigation,
/// 6.2.2).
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

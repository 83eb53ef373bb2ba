#include "evaluation/velocity_filter.h"

#include <Eigen/LU>

#include "base/time.h"

namespace visual_localization {
namespace {

constexpr double kAcceleration_m_s2 = 0.2;  ///< standard deviation, per axis, for a second
constexpr double kSpeed_m_s = 10.0;         ///< of a robot that nothing is known of
constexpr double kLongestPause_s = 10.0;
constexpr double kGate = 30.0;  ///< squared Mahalanobis distance: beyond, it is another place

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

}  // namespace visual_localization

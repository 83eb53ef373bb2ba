#include "visual_localization/ros/initial_pose.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/LU>

#include "visual_localization/io/one_line.h"

namespace visual_localization {
namespace {

constexpr std::size_t kRow = 6;  ///< x, y, z and three rotations

void refuseUnless(bool condition, const std::string& reason) {
  if (!condition) throw std::invalid_argument(reason);
}

bool finite(const geometry_msgs::Pose& pose) {
  const auto& p = pose.position;
  const auto& q = pose.orientation;
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) && std::isfinite(q.x) && std::isfinite(q.y) &&
         std::isfinite(q.z) && std::isfinite(q.w);
}

/// Two symmetric 2 x 2 entries are equal up to rounding, trace and determinant not negative up to rounding.
void checkCovariance(const Eigen::Matrix2d& covariance) {
  const double scale = covariance.cwiseAbs().maxCoeff();
  refuseUnless(scale <= kLargestCoordinate_m * kLargestCoordinate_m, "the covariance is larger than any local map");
  refuseUnless(std::abs(covariance(0, 1) - covariance(1, 0)) <= 1e-9 * scale, "the covariance is not symmetric");
  refuseUnless(covariance(0, 0) >= 0.0 && covariance(1, 1) >= 0.0 && covariance.determinant() >= -1e-12 * scale * scale,
               "the covariance of x and y is not positive semi-definite");
}

}  // namespace

SharedLocalizer::Guess guessFrom(const geometry_msgs::PoseWithCovarianceStamped& message,
                                 const std::string& global_frame) {
  const std::string& frame = message.header.frame_id;
  refuseUnless(frame == global_frame || frame == "/" + global_frame,
               "its frame is '" + oneLine(frame, 100) + "' instead of '" + global_frame + "'");
  refuseUnless(finite(message.pose.pose), "the pose is not finite");
  const auto& covariance = message.pose.covariance;
  refuseUnless(std::all_of(covariance.begin(), covariance.end(), [](double value) { return std::isfinite(value); }),
               "the covariance is not finite");

  SharedLocalizer::Guess guess;
  guess.mean_m = {message.pose.pose.position.x, message.pose.pose.position.y};
  refuseUnless(guess.mean_m.cwiseAbs().maxCoeff() <= kLargestCoordinate_m, "the position is beyond any local map");
  guess.covariance_m2 << covariance[0], covariance[1], covariance[kRow], covariance[kRow + 1];
  checkCovariance(guess.covariance_m2);
  guess.covariance_m2 = 0.5 * (guess.covariance_m2 + guess.covariance_m2.transpose()).eval();
  return guess;
}

void requireDisc(const Eigen::Vector2d& centre_m, double radius_m) {
  refuseUnless(centre_m.allFinite() && centre_m.cwiseAbs().maxCoeff() <= kLargestCoordinate_m,
               "the centre is not a place on the map");
  refuseUnless(std::isfinite(radius_m) && radius_m > 0.0 && radius_m <= kLargestCoordinate_m,
               "the radius must be positive and no larger than a local map");
}

}  // namespace visual_localization

#include "camera/lens.h"

#include <cmath>

#include <opencv2/calib3d.hpp>

#include "base/angles.h"

namespace visual_localization::lens {
namespace {

constexpr double kWidestAngle_rad = 85.0 / 180.0 * kPi;

double at(const std::vector<double>& coefficients, std::size_t i) {
  return i < coefficients.size() ? coefficients[i] : 0.0;
}

/// Angle on the sensor of a ray `theta` from the axis (Kannala and Brandt).
double fisheyeAngle(const std::vector<double>& k, double theta) {
  const double t2 = theta * theta;
  return theta * (1.0 + t2 * (at(k, 0) + t2 * (at(k, 1) + t2 * (at(k, 2) + t2 * at(k, 3)))));
}

/// What a radius is multiplied with (Brown and Conrady, with the denominator of the rational model).
double radialFactor(const std::vector<double>& k, double r2) {
  const double numerator = 1.0 + r2 * (at(k, 0) + r2 * (at(k, 1) + r2 * at(k, 4)));
  const double denominator = 1.0 + r2 * (at(k, 5) + r2 * (at(k, 6) + r2 * at(k, 7)));
  return denominator > 0.0 ? numerator / denominator : -1.0;
}

double distortedRadius(Distortion model, const std::vector<double>& coefficients, double angle_rad) {
  if (model == Distortion::kEquidistant) return fisheyeAngle(coefficients, angle_rad);
  const double radius = std::tan(angle_rad);
  return radius * radialFactor(coefficients, radius * radius);
}

}  // namespace

Eigen::Vector2d distort(Distortion model, const std::vector<double>& k, const Eigen::Vector2d& normalised) {
  const double r2 = normalised.squaredNorm();
  if (model == Distortion::kEquidistant) {
    const double r = std::sqrt(r2);
    return r > 0.0 ? Eigen::Vector2d(normalised * (fisheyeAngle(k, std::atan(r)) / r)) : normalised;
  }
  const double x = normalised.x();
  const double y = normalised.y();
  const double p1 = at(k, 2);
  const double p2 = at(k, 3);
  const Eigen::Vector2d tangential(2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
                                   p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y);
  return normalised * radialFactor(k, r2) + tangential;
}

double widestRadius(Distortion model, const std::vector<double>& coefficients) {
  constexpr int kSteps = 1700;  // of a twentieth of a degree
  double angle_rad = 0.0;
  double radius = 0.0;
  for (int i = 1; i <= kSteps; ++i) {
    const double next_rad = kWidestAngle_rad * i / kSteps;
    const double next = distortedRadius(model, coefficients, next_rad);
    if (!(next > radius)) break;
    angle_rad = next_rad;
    radius = next;
  }
  return std::tan(angle_rad);
}

std::vector<Eigen::Vector2d> undistort(Distortion model, const std::vector<double>& coefficients,
                                       const std::vector<Eigen::Vector2d>& distorted) {
  if (distorted.empty()) return {};
  std::vector<Eigen::Vector2d> normalised(distorted.size());
  static_assert(sizeof(Eigen::Vector2d) == 2 * sizeof(double), "OpenCV reads and writes these points in place");
  const auto count = static_cast<int>(distorted.size());
  const cv::Mat from(count, 1, CV_64FC2, const_cast<Eigen::Vector2d*>(distorted.data()));  // only read
  cv::Mat to(count, 1, CV_64FC2, normalised.data());
  const cv::Matx33d identity = cv::Matx33d::eye();
  if (model == Distortion::kEquidistant) {
    cv::fisheye::undistortPoints(from, to, identity, coefficients);
  } else {
    // Its own five iterations leave errors of pixels in the corners of a wide lens.
    const cv::TermCriteria until(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 100, 1e-10);
    cv::undistortPoints(from, to, identity, coefficients, cv::noArray(), cv::noArray(), until);
  }
  CV_Assert(to.ptr() == reinterpret_cast<const unsigned char*>(normalised.data()));  // not allocated anew
  return normalised;
}

}  // namespace visual_localization::lens

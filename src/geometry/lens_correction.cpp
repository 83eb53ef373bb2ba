#include "geometry/lens_correction.h"

#include <algorithm>
#include <cmath>

namespace visual_localization {
namespace {

constexpr std::size_t kPlumbBobCoefficients = 5;

}  // namespace

Intrinsics corrected(const Intrinsics& published, const LensCorrection& correction) {
  Intrinsics lens = published;
  if (correction.isZero(0.0)) return lens;
  lens.fx *= std::exp(correction[kFocalLength]);
  lens.fy *= std::exp(correction[kFocalLength] + correction[kAspect]);
  lens.cx += published.fx * correction[kPrincipalX];
  lens.cy += published.fy * correction[kPrincipalY];
  if (correction[kRadial1] == 0.0 && correction[kRadial2] == 0.0) return lens;
  if (lens.distortion == Distortion::kPlumbBob) lens.coefficients.resize(kPlumbBobCoefficients, 0.0);
  lens.coefficients[0] += correction[kRadial1];
  lens.coefficients[1] += correction[kRadial2];
  return lens;
}

LensProjection::LensProjection(const Intrinsics& published, const LensCorrection& correction)
    : focal_px_(published.fx * std::exp(correction[kFocalLength]),
                published.fy * std::exp(correction[kFocalLength] + correction[kAspect])),
      centre_px_(published.cx + published.fx * correction[kPrincipalX],
                 published.cy + published.fy * correction[kPrincipalY]),
      published_focal_px_(published.fx, published.fy),
      is_fisheye_(published.distortion == Distortion::kEquidistant) {
  std::copy(published.coefficients.begin(), published.coefficients.end(), k_);
  k_[0] += correction[kRadial1];
  k_[1] += correction[kRadial2];
}

Eigen::Vector2d LensProjection::project(const Eigen::Vector2d& ray, Eigen::Matrix2d* by_ray,
                                        Eigen::Matrix<double, 2, 6>* by_correction) const {
  Eigen::Matrix2d by_radial;
  Eigen::Matrix2d* radial = by_correction != nullptr ? &by_radial : nullptr;
  const Eigen::Vector2d point = is_fisheye_ ? fisheye(ray, by_ray, radial) : distorted(ray, by_ray, radial);
  if (by_ray != nullptr) *by_ray = focal_px_.asDiagonal() * *by_ray;
  if (by_correction != nullptr) {
    const Eigen::Vector2d scaled = focal_px_.cwiseProduct(point);
    by_correction->col(kFocalLength) = scaled;
    by_correction->col(kAspect) = Eigen::Vector2d(0.0, scaled.y());
    by_correction->col(kPrincipalX) = Eigen::Vector2d(published_focal_px_.x(), 0.0);
    by_correction->col(kPrincipalY) = Eigen::Vector2d(0.0, published_focal_px_.y());
    by_correction->rightCols<2>() = focal_px_.asDiagonal() * by_radial;
  }
  return focal_px_.cwiseProduct(point) + centre_px_;
}

Eigen::Vector2d LensProjection::distorted(const Eigen::Vector2d& ray, Eigen::Matrix2d* by_ray,
                                          Eigen::Matrix2d* by_radial) const {
  const double x = ray.x();
  const double y = ray.y();
  const double r2 = ray.squaredNorm();
  const double numerator = 1.0 + r2 * (k_[0] + r2 * (k_[1] + r2 * k_[4]));
  const double denominator = 1.0 + r2 * (k_[5] + r2 * (k_[6] + r2 * k_[7]));
  const double factor = numerator / denominator;
  const double p1 = k_[2];
  const double p2 = k_[3];
  if (by_ray != nullptr) {
    const double by_r2 =
        (k_[0] + r2 * (2.0 * k_[1] + 3.0 * r2 * k_[4]) - factor * (k_[5] + r2 * (2.0 * k_[6] + 3.0 * r2 * k_[7]))) /
        denominator;
    const double mixed = 2.0 * (p1 * x + p2 * y);
    *by_ray = factor * Eigen::Matrix2d::Identity() + 2.0 * by_r2 * ray * ray.transpose();
    *by_ray += (Eigen::Matrix2d() << 2.0 * p1 * y + 6.0 * p2 * x, mixed, mixed, 6.0 * p1 * y + 2.0 * p2 * x).finished();
  }
  if (by_radial != nullptr) *by_radial << r2 / denominator * ray, r2 * r2 / denominator * ray;
  const Eigen::Vector2d tangential(2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
                                   p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y);
  return factor * ray + tangential;
}

Eigen::Vector2d LensProjection::fisheye(const Eigen::Vector2d& ray, Eigen::Matrix2d* by_ray,
                                        Eigen::Matrix2d* by_radial) const {
  constexpr double kOnAxis = 1e-8;
  const double r = std::max(ray.norm(), kOnAxis);
  const double theta = std::atan(r);
  const double t2 = theta * theta;
  const double on_sensor = theta * (1.0 + t2 * (k_[0] + t2 * (k_[1] + t2 * (k_[2] + t2 * k_[3]))));
  const double factor = on_sensor / r;
  if (by_ray != nullptr) {
    const double by_theta = 1.0 + t2 * (3.0 * k_[0] + t2 * (5.0 * k_[1] + t2 * (7.0 * k_[2] + t2 * 9.0 * k_[3])));
    const double by_r = (by_theta / (1.0 + r * r) - factor) / r;
    *by_ray = factor * Eigen::Matrix2d::Identity() + by_r / r * ray * ray.transpose();
  }
  if (by_radial != nullptr) *by_radial << t2 * theta / r * ray, t2 * t2 * theta / r * ray;
  return factor * ray;
}

}  // namespace visual_localization

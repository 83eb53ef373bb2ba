#pragma once

#include <Eigen/Core>

#include "visual_localization/camera/camera_model.h"

namespace visual_localization {

/// How a lens differs from its published calibration: logarithm of the factor of both focal lengths, of the one of fy
/// alone, shift of the principal point (x, y; focal lengths), additions to the radial coefficients k1 and k2.
using LensCorrection = Eigen::Matrix<double, 6, 1>;

/// Order of the entries of a LensCorrection.
enum LensEntry { kFocalLength, kAspect, kPrincipalX, kPrincipalY, kRadial1, kRadial2 };

/// The calibration with its correction.
Intrinsics corrected(const Intrinsics& published, const LensCorrection& correction);

/// Projection by a lens, with derivatives: Brown and Conrady's model, the rational one, or Kannala and Brandt's, as
/// OpenCV has them.
class LensProjection {
 public:
  /// `lens` is not checked. The correction is one of `published`, whose focal lengths are its units.
  LensProjection(const Intrinsics& published, const LensCorrection& correction);

  /// Pixels of a ray, x/z and y/z. `by_ray` and `by_correction` may be null.
  Eigen::Vector2d project(const Eigen::Vector2d& ray, Eigen::Matrix2d* by_ray = nullptr,
                          Eigen::Matrix<double, 2, 6>* by_correction = nullptr) const;

 private:
  /// On normalised coordinates; `by_radial`: derivatives by k1 and k2.
  Eigen::Vector2d distorted(const Eigen::Vector2d& ray, Eigen::Matrix2d* by_ray, Eigen::Matrix2d* by_radial) const;
  Eigen::Vector2d fisheye(const Eigen::Vector2d& ray, Eigen::Matrix2d* by_ray, Eigen::Matrix2d* by_radial) const;

  Eigen::Vector2d focal_px_;
  Eigen::Vector2d centre_px_;
  Eigen::Vector2d published_focal_px_;
  bool is_fisheye_;
  double k_[8] = {};  ///< in the order of sensor_msgs/CameraInfo; what a model lacks is zero
};

}  // namespace visual_localization

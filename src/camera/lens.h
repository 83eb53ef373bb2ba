#pragma once

#include <vector>

#include <Eigen/Core>

#include "visual_localization/camera/camera_model.h"

/// The equations of the lens models (OpenCV's documentation of calib3d), on normalised coordinates.
namespace visual_localization::lens {

/// Of an undistorted ray. Meaningless beyond widestRadius().
Eigen::Vector2d distort(Distortion model, const std::vector<double>& coefficients, const Eigen::Vector2d& normalised);

/// Up to which length of normalised coordinates the distorted radius grows with the undistorted one, at most that of
/// a ray 85 degrees from the axis. Tangential coefficients are left aside.
double widestRadius(Distortion model, const std::vector<double>& coefficients);

/// By OpenCV, iteratively. Where it does not converge, anything; check by distort().
std::vector<Eigen::Vector2d> undistort(Distortion model, const std::vector<double>& coefficients,
                                       const std::vector<Eigen::Vector2d>& distorted);

}  // namespace visual_localization::lens

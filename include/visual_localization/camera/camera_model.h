#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// A calibration or a mask that cannot be used. The text is one line: what is wrong, its value and what is allowed.
class CameraError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// How the lens bends rays, under the names of sensor_msgs/CameraInfo.
enum class Distortion {
  kPlumbBob,            ///< "plumb_bob": k1, k2, p1, p2, k3; also four of them, or none for a lens without distortion
  kRationalPolynomial,  ///< "rational_polynomial": k1, k2, p1, p2, k3, k4, k5, k6
  kEquidistant,         ///< "equidistant" (fisheye): k1, k2, k3, k4
};

/// The name in sensor_msgs/CameraInfo.
std::string toString(Distortion distortion);
/// Inverse of toString(). Throws CameraError naming the three models for anything else.
Distortion distortionOf(const std::string& name);

/// Numbers of a calibration before anybody has checked them. Pixels, pixel centres at whole numbers.
struct Intrinsics {
  cv::Size size;
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;
  Distortion distortion = Distortion::kPlumbBob;
  std::vector<double> coefficients;  ///< in the order of sensor_msgs/CameraInfo
};

/// A calibrated camera: rays to pixels and back, by OpenCV's models. A value; what exists is valid.
///
/// Frame of the camera: x right, y down, z forward (REP 103, optical). Normalised coordinates: x/z, y/z.
///
/// A ray is usable up to 85 degrees from the optical axis, or up to where the lens model folds back, if that is nearer.
/// Pixels of other rays (the black corners of a fisheye lens) have no normalised coordinates.
class CameraModel {
 public:
  /// Throws CameraError unless every number is finite and in range: sides 1 to 32768, focal lengths 0.1 to 100 image
  /// sides, the principal point not farther outside the image than half a side, 0, 4 or 5 coefficients of plumb_bob, 8
  /// of rational_polynomial, 4 of equidistant; and unless undistortion works in the middle half of the image's width
  /// and height.
  explicit CameraModel(const Intrinsics& intrinsics);

  const Intrinsics& intrinsics() const { return intrinsics_; }
  const cv::Size& size() const { return intrinsics_.size; }
  /// Whether all coefficients of a model without further effect are zero: normalised coordinates are linear in pixels.
  bool isPinhole() const { return pinhole_; }
  /// Share of the image that can be undistorted, (0, 1], found on a grid.
  double usableShare() const;

  /// The same camera with its images resized to `size`, by the convention of cv::resize:
  /// x' = (x + 0.5) * size.width / width - 0.5. Throws CameraError when a side of `size` is not 1 to 32768.
  CameraModel scaledTo(const cv::Size& size) const;

  /// Normalised coordinates of `pixels`, in their order. NaN in both where a pixel belongs to no usable ray.
  std::vector<Eigen::Vector2d> undistort(const std::vector<Eigen::Vector2d>& pixels) const;
  /// Where the camera sees a point, pixels, whether in the image or not. `in_camera`: metres or any other unit, frame
  /// of the camera. NaN in both when the point is on no usable ray: behind the camera, or too far from the axis.
  Eigen::Vector2d project(const Eigen::Vector3d& in_camera) const;
  /// The same for normalised coordinates.
  Eigen::Vector2d distort(const Eigen::Vector2d& normalised) const;

 private:
  Eigen::Vector2d distorted(const Eigen::Vector2d& normalised) const;
  std::vector<Eigen::Vector2d> undistorted(const std::vector<Eigen::Vector2d>& distorted) const;

  Intrinsics intrinsics_;
  bool pinhole_ = true;
  double widest_ = 0.0;  ///< largest length of normalised coordinates of a usable ray
};

/// Equal to the last bit.
bool operator==(const CameraModel& a, const CameraModel& b);
inline bool operator!=(const CameraModel& a, const CameraModel& b) { return !(a == b); }

/// Equal but for rounding: every number to a millionth of a focal length, or of one.
bool areAlike(const CameraModel& a, const CameraModel& b);

/// In a few words: "320 x 240 px, focal length 266.3 x 266.3 px, plumb_bob".
std::string describe(const CameraModel& camera);
/// What differs of two cameras, in words: "fx 266.3 instead of 260.1, distortion plumb_bob instead of equidistant";
/// empty when they are equal. `camera` comes first.
std::string differences(const CameraModel& camera, const CameraModel& reference);

/// By name: width, height, fx, fy, cx, cy, distortion, d0, d1, ...
ParameterValues toValues(const CameraModel& camera);
/// Inverse of toValues(). Throws CameraError when a value is missing, unknown, of the wrong type or not allowed.
CameraModel cameraOf(const ParameterValues& values);

}  // namespace visual_localization

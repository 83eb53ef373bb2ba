#include "visual_localization/camera/camera_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/text.h"
#include "camera/lens.h"

namespace visual_localization {
namespace {

constexpr int kLargestSide_px = 32768;
constexpr double kShortestFocalLength = 0.1;  ///< image sides
constexpr double kLongestFocalLength = 100.0;
constexpr double kFarthestPrincipalPoint = 0.5;  ///< image sides outside the image
constexpr double kLargestCoefficient = 1e6;
constexpr double kRounding = 1e-9;  ///< relative: a camera that was scaled is still allowed
/// How far distort() may miss what was undistorted, normalised: at 300 pixels of focal length 0.003 pixels.
constexpr double kRoundTrip = 1e-5;

std::string text(double value, int digits = 6) {
  std::ostringstream out = numberStream(digits);
  out << value;
  return out.str();
}

void requireIn(const std::string& field, double value, double least, double most) {
  const double slack = kRounding * std::max(std::abs(least), std::abs(most));
  if (value >= least - slack && value <= most + slack) return;  // not so for NaN
  throw CameraError(field + " = " + text(value) + " is not in [" + text(least) + ", " + text(most) + "]");
}

void requireSize(const cv::Size& size) {
  requireIn("image width", size.width, 1, kLargestSide_px);
  requireIn("image height", size.height, 1, kLargestSide_px);
}

/// Along one axis of the image. Ranges are in image sides, so that they hold for the scaled camera as well.
void requireAxis(const std::string& axis, double focal_length, double centre, int side_px) {
  requireIn("f" + axis, focal_length, kShortestFocalLength * side_px, kLongestFocalLength * side_px);
  const double outside_px = kFarthestPrincipalPoint * side_px;
  requireIn("c" + axis, centre, -outside_px - 0.5, side_px + outside_px - 0.5);
}

void requireCoefficients(Distortion distortion, const std::vector<double>& coefficients) {
  const std::size_t count = coefficients.size();
  const bool plumb_bob = distortion == Distortion::kPlumbBob;
  const bool fits =
      plumb_bob ? count == 0 || count == 4 || count == 5 : count == (distortion == Distortion::kEquidistant ? 4U : 8U);
  if (!fits) {
    const char* allowed = plumb_bob ? "0, 4 or 5" : distortion == Distortion::kEquidistant ? "4" : "8";
    throw CameraError("the distortion model " + toString(distortion) + " takes " + allowed + " coefficients, not " +
                      std::to_string(count));
  }
  for (std::size_t i = 0; i < count; ++i) {
    requireIn("distortion coefficient " + std::to_string(i), coefficients[i], -kLargestCoefficient,
              kLargestCoefficient);
  }
}

Eigen::Vector2d nothing() { return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN()); }

}  // namespace

CameraModel::CameraModel(const Intrinsics& intrinsics) : intrinsics_(intrinsics) {
  requireSize(size());
  requireAxis("x", intrinsics_.fx, intrinsics_.cx, size().width);
  requireAxis("y", intrinsics_.fy, intrinsics_.cy, size().height);
  requireCoefficients(intrinsics_.distortion, intrinsics_.coefficients);
  const std::vector<double>& coefficients = intrinsics_.coefficients;
  pinhole_ = intrinsics_.distortion != Distortion::kEquidistant &&
             std::all_of(coefficients.begin(), coefficients.end(), [](double value) { return value == 0.0; });
  widest_ = lens::widestRadius(intrinsics_.distortion, coefficients);
  findUsableShare();
}

/// Undistorts a grid over the whole image. Throws CameraError when that fails in its middle.
void CameraModel::findUsableShare() {
  constexpr int kGrid = 16;
  std::vector<Eigen::Vector2d> pixels;
  for (int row = 0; row <= kGrid; ++row) {
    for (int column = 0; column <= kGrid; ++column) {
      pixels.emplace_back(size().width * column / double{kGrid} - 0.5, size().height * row / double{kGrid} - 0.5);
    }
  }
  const std::vector<Eigen::Vector2d> rays = undistort(pixels);
  const auto usable = [&rays](int row, int column) {
    return rays[static_cast<std::size_t>(row * (kGrid + 1) + column)].allFinite();
  };
  int count = 0;
  for (int row = 0; row <= kGrid; ++row) {
    for (int column = 0; column <= kGrid; ++column) {
      const bool inner = std::abs(2 * row - kGrid) <= kGrid / 2 && std::abs(2 * column - kGrid) <= kGrid / 2;
      if (usable(row, column)) {
        ++count;
      } else if (inner) {
        const Eigen::Vector2d& pixel = pixels[static_cast<std::size_t>(row * (kGrid + 1) + column)];
        throw CameraError("the distortion cannot be undone at pixel (" + text(pixel.x()) + ", " + text(pixel.y()) +
                          "), which is in the middle of the image: the coefficients do not describe this camera");
      }
    }
  }
  usable_share_ = static_cast<double>(count) / static_cast<double>(pixels.size());
}

CameraModel CameraModel::scaledTo(const cv::Size& size) const {
  if (size == intrinsics_.size) return *this;
  requireSize(size);
  const double x = static_cast<double>(size.width) / intrinsics_.size.width;
  const double y = static_cast<double>(size.height) / intrinsics_.size.height;
  CameraModel scaled = *this;
  scaled.intrinsics_.size = size;
  scaled.intrinsics_.fx *= x;
  scaled.intrinsics_.fy *= y;
  scaled.intrinsics_.cx = (intrinsics_.cx + 0.5) * x - 0.5;
  scaled.intrinsics_.cy = (intrinsics_.cy + 0.5) * y - 0.5;
  return scaled;
}

std::vector<Eigen::Vector2d> CameraModel::undistort(const std::vector<Eigen::Vector2d>& pixels) const {
  std::vector<Eigen::Vector2d> rays(pixels.size());
  std::transform(pixels.begin(), pixels.end(), rays.begin(), [this](const Eigen::Vector2d& pixel) {
    return Eigen::Vector2d((pixel.x() - intrinsics_.cx) / intrinsics_.fx,
                           (pixel.y() - intrinsics_.cy) / intrinsics_.fy);
  });
  return pinhole_ ? rays : undistorted(rays);
}

std::vector<Eigen::Vector2d> CameraModel::undistorted(const std::vector<Eigen::Vector2d>& distorted) const {
  std::vector<Eigen::Vector2d> rays = lens::undistort(intrinsics_.distortion, intrinsics_.coefficients, distorted);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const bool usable = rays[i].norm() <= widest_ && (this->distorted(rays[i]) - distorted[i]).norm() <= kRoundTrip;
    if (!usable) rays[i] = nothing();
  }
  return rays;
}

Eigen::Vector2d CameraModel::project(const Eigen::Vector3d& in_camera) const {
  if (!(in_camera.z() > 0.0)) return nothing();
  return distort(in_camera.head<2>() / in_camera.z());
}

Eigen::Vector2d CameraModel::distort(const Eigen::Vector2d& normalised) const {
  if (!(normalised.norm() <= widest_)) return nothing();
  const Eigen::Vector2d point = distorted(normalised);
  return {intrinsics_.fx * point.x() + intrinsics_.cx, intrinsics_.fy * point.y() + intrinsics_.cy};
}

Eigen::Vector2d CameraModel::distorted(const Eigen::Vector2d& normalised) const {
  return pinhole_ ? normalised : lens::distort(intrinsics_.distortion, intrinsics_.coefficients, normalised);
}

}  // namespace visual_localization

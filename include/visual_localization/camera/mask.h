#pragma once

#include <string>

#include <opencv2/core.hpp>

#include "visual_localization/camera/camera_model.h"

namespace visual_localization {

/// Which part of a camera's image is used; the rest shows the robot itself. A value, cheap to copy. An empty mask uses
/// the whole image.
class Mask {
 public:
  Mask() = default;
  /// `grey`: 8-bit, one channel; pixels from 128 on are used. Throws CameraError for anything else and when no pixel is
  /// used.
  explicit Mask(const cv::Mat& grey);

  bool empty() const { return grey_.empty(); }
  cv::Size size() const { return grey_.size(); }
  /// 255 where the image is used, otherwise 0; 8-bit, to be read only.
  const cv::Mat& grey() const { return grey_; }
  /// Whether the pixel at this point is used, pixel centres at whole numbers. Points outside count as the nearest
  /// pixel.
  bool allows(float x_px, float y_px) const;
  /// Share of the image that is used, (0, 1].
  double usedShare() const;

  /// The mask of images resized to `size`: the nearest pixel each. Throws CameraError when nothing of it is left.
  Mask scaledTo(const cv::Size& size) const;

 private:
  cv::Mat grey_;
};

/// Pixel by pixel; an empty mask equals only another.
bool operator==(const Mask& a, const Mask& b);
inline bool operator!=(const Mask& a, const Mask& b) { return !(a == b); }

/// Reads a PNG of 8 bits, one channel, at most 64 MB and 8192 x 8192 pixels. Throws CameraError beginning with the
/// path.
Mask readMask(const std::string& path);

/// The calibration of a camera for its images as they come: `camera` itself, or scaled when they are resized. Throws
/// CameraError when `images` have another shape: then they are cut, or another camera's.
CameraModel fittedTo(const cv::Size& images, const CameraModel& camera);
/// The same for a mask; an empty one fits all images.
Mask fittedTo(const cv::Size& images, const Mask& mask);

}  // namespace visual_localization

#pragma once

#include <cstdint>
#include <stdexcept>
#include <vector>

#include <opencv2/core.hpp>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>

namespace visual_localization {

/// An image message that cannot be used. The text is the reason, in one line.
class ImageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// 8-bit grey of mono, bgr, rgb, bgra, rgba or bayer_* of 8 or 16 bits, yuv422 (uyvy), yuv422_yuy2 (yuyv), or OpenCV's
/// names for such pixels. Sixteen bits become eight by the least depth of 10, 12, 14 or 16 bits that holds the
/// brightest pixel. Throws ImageError for any other encoding, for more than 16 777 216 pixels (4096 x 4096) or 16384 a
/// side, and when size, step and data do not agree.
cv::Mat toGrey(const sensor_msgs::Image& message);

/// 8-bit grey of a JPEG or PNG; bytes behind its end do not matter. Throws ImageError when it is neither, broken, cut
/// off or larger than a raw one may be, before it takes memory for the pixels.
cv::Mat toGrey(const sensor_msgs::CompressedImage& message);

/// Pixels, by the header; nothing is decoded. Throws ImageError where toGrey finds the message unusable without
/// decoding it.
cv::Size sizeOf(const sensor_msgs::Image& message);
cv::Size sizeOf(const sensor_msgs::CompressedImage& message);

/// Pixels, by the header of a JPEG or PNG. Throws ImageError when it is neither, empty or too large.
cv::Size compressedSize(const std::vector<std::uint8_t>& file);

/// 8-bit grey of a JPEG or PNG. Throws ImageError when it is neither, broken, cut off or too large. Takes no memory for
/// pixels before the decoder has read how many there are, and none for texts in the file.
cv::Mat decodedToGrey(const std::vector<std::uint8_t>& file);

}  // namespace visual_localization

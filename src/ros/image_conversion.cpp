#include "visual_localization/ros/image_conversion.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "base/text.h"
#include "ros/image_depth.h"

namespace visual_localization {
namespace {

constexpr int kAsItIs = -1;  ///< grey already

/// How OpenCV reads the pixels, and how it makes them grey.
struct Encoding {
  const char* name;
  int type;
  int to_grey;
};

/// As cv_bridge has them. 8UC3 is taken for BGR; Bayer patterns have other names in OpenCV, by the second row.
constexpr std::array<Encoding, 27> kEncodings{{{"mono8", CV_8UC1, kAsItIs},
                                               {"mono16", CV_16UC1, kAsItIs},
                                               {"bgr8", CV_8UC3, cv::COLOR_BGR2GRAY},
                                               {"rgb8", CV_8UC3, cv::COLOR_RGB2GRAY},
                                               {"bgra8", CV_8UC4, cv::COLOR_BGRA2GRAY},
                                               {"rgba8", CV_8UC4, cv::COLOR_RGBA2GRAY},
                                               {"bgr16", CV_16UC3, cv::COLOR_BGR2GRAY},
                                               {"rgb16", CV_16UC3, cv::COLOR_RGB2GRAY},
                                               {"bgra16", CV_16UC4, cv::COLOR_BGRA2GRAY},
                                               {"rgba16", CV_16UC4, cv::COLOR_RGBA2GRAY},
                                               {"bayer_rggb8", CV_8UC1, cv::COLOR_BayerBG2GRAY},
                                               {"bayer_bggr8", CV_8UC1, cv::COLOR_BayerRG2GRAY},
                                               {"bayer_gbrg8", CV_8UC1, cv::COLOR_BayerGR2GRAY},
                                               {"bayer_grbg8", CV_8UC1, cv::COLOR_BayerGB2GRAY},
                                               {"bayer_rggb16", CV_16UC1, cv::COLOR_BayerBG2GRAY},
                                               {"bayer_bggr16", CV_16UC1, cv::COLOR_BayerRG2GRAY},
                                               {"bayer_gbrg16", CV_16UC1, cv::COLOR_BayerGR2GRAY},
                                               {"bayer_grbg16", CV_16UC1, cv::COLOR_BayerGB2GRAY},
                                               {"yuv422", CV_8UC2, cv::COLOR_YUV2GRAY_UYVY},
                                               {"uyvy", CV_8UC2, cv::COLOR_YUV2GRAY_UYVY},
                                               {"yuv422_yuy2", CV_8UC2, cv::COLOR_YUV2GRAY_YUY2},
                                               {"yuyv", CV_8UC2, cv::COLOR_YUV2GRAY_YUY2},
                                               {"8UC1", CV_8UC1, kAsItIs},
                                               {"8UC3", CV_8UC3, cv::COLOR_BGR2GRAY},
                                               {"8UC4", CV_8UC4, cv::COLOR_BGRA2GRAY},
                                               {"16UC1", CV_16UC1, kAsItIs},
                                               {"16UC3", CV_16UC3, cv::COLOR_BGR2GRAY}}};

/// For a one-line message: short and printable.
std::string printable(const std::string& text) {
  std::string shown = text.substr(0, 40);
  std::replace_if(
      shown.begin(), shown.end(), [](char c) { return c < 32 || c > 126; }, '?');
  return "'" + shown + "'";
}

const Encoding& encodingOf(const std::string& name) {
  const auto* found =
      std::find_if(kEncodings.begin(), kEncodings.end(), [&name](const Encoding& known) { return name == known.name; });
  if (found != kEncodings.end()) return *found;
  std::vector<std::string> names;
  for (const Encoding& known : kEncodings) names.emplace_back(known.name);
  throw ImageError("image encoding " + printable(name) + " is not supported; supported are " + joined(names));
}

std::uint64_t rowBytes(const sensor_msgs::Image& message, const Encoding& encoding) {
  return std::uint64_t{message.width} * CV_ELEM_SIZE(encoding.type);
}

/// Zero: nothing is between the rows.
std::uint64_t stepOf(const sensor_msgs::Image& message, const Encoding& encoding) {
  return message.step == 0 ? rowBytes(message, encoding) : message.step;
}

const Encoding& requireConsistent(const sensor_msgs::Image& message) {
  const Encoding& encoding = encodingOf(message.encoding);
  requireImageSize(message.width, message.height);
  const std::uint64_t step = stepOf(message, encoding);
  if (step < rowBytes(message, encoding)) {
    throw ImageError("image step is " + std::to_string(step) + " bytes, a row needs " +
                     std::to_string(rowBytes(message, encoding)));
  }
  const std::uint64_t bytes = step * message.height;
  if (message.data.size() != bytes) {
    throw ImageError("image data has " + std::to_string(message.data.size()) + " bytes, step x height is " +
                     std::to_string(bytes));
  }
  return encoding;
}

bool hasSwappedBytes(const sensor_msgs::Image& message, const Encoding& encoding) {
  return message.is_bigendian != 0 && CV_ELEM_SIZE1(encoding.type) == 2;
}

sensor_msgs::Image withBytesSwapped(sensor_msgs::Image message, std::size_t step, std::size_t row_bytes) {
  for (std::size_t row = 0; row < message.data.size(); row += step) {
    for (std::size_t at = row; at < row + row_bytes; at += 2) std::swap(message.data[at], message.data[at + 1]);
  }
  message.is_bigendian = 0;
  return message;
}

}  // namespace

cv::Size sizeOf(const sensor_msgs::Image& message) {
  requireConsistent(message);
  return {static_cast<int>(message.width), static_cast<int>(message.height)};
}

cv::Size sizeOf(const sensor_msgs::CompressedImage& message) { return compressedSize(message.data); }

cv::Mat toGrey(const sensor_msgs::Image& message) {
  const Encoding& encoding = requireConsistent(message);
  if (hasSwappedBytes(message, encoding)) {
    return toGrey(withBytesSwapped(message, stepOf(message, encoding), rowBytes(message, encoding)));
  }
  try {
    const cv::Mat pixels(sizeOf(message), encoding.type, const_cast<std::uint8_t*>(message.data.data()),  // only read
                         stepOf(message, encoding));
    if (encoding.to_grey == kAsItIs) return encoding.type == CV_8UC1 ? pixels.clone() : inEightBits(pixels);
    cv::Mat grey;
    cv::cvtColor(pixels, grey, encoding.to_grey);
    return inEightBits(grey);
  } catch (const cv::Exception& error) {
    throw ImageError("image cannot be converted: " + error.err);
  }
}

cv::Mat toGrey(const sensor_msgs::CompressedImage& message) { return decodedToGrey(message.data); }

}  // namespace visual_localization

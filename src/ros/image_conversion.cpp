#include "visual_localization/ros/image_conversion.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <cv_bridge/cv_bridge.h>

#include "base/text.h"
#include "ros/compressed_image.h"

namespace visual_localization {
namespace {

struct Encoding {
  const char* name;
  std::uint64_t bytes_per_pixel;
};

constexpr std::array<Encoding, 10> kEncodings{{{"mono8", 1},
                                               {"mono16", 2},
                                               {"bgr8", 3},
                                               {"rgb8", 3},
                                               {"bgra8", 4},
                                               {"rgba8", 4},
                                               {"bayer_rggb8", 1},
                                               {"bayer_bggr8", 1},
                                               {"bayer_gbrg8", 1},
                                               {"bayer_grbg8", 1}}};

/// Foreign text for a one-line message: short and printable.
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

void requireConsistent(const sensor_msgs::Image& message) {
  const Encoding& encoding = encodingOf(message.encoding);
  requireImageSize(message.width, message.height);
  const std::uint64_t row_bytes = message.width * encoding.bytes_per_pixel;
  if (message.step < row_bytes) {
    throw ImageError("image step is " + std::to_string(message.step) + " bytes, a row needs " +
                     std::to_string(row_bytes));
  }
  const std::uint64_t bytes = std::uint64_t{message.step} * message.height;
  if (message.data.size() != bytes) {
    throw ImageError("image data has " + std::to_string(message.data.size()) + " bytes, step x height is " +
                     std::to_string(bytes));
  }
}

bool hasSwappedBytes(const sensor_msgs::Image& message) {
  return message.is_bigendian != 0 && message.encoding == "mono16";
}

/// cv_bridge makes another kind of image when it swaps bytes itself.
sensor_msgs::Image withBytesSwapped(sensor_msgs::Image message) {
  for (std::size_t row = 0; row < message.data.size(); row += message.step) {
    for (std::size_t at = row; at < row + 2 * std::size_t{message.width}; at += 2) {
      std::swap(message.data[at], message.data[at + 1]);
    }
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
  requireConsistent(message);
  if (hasSwappedBytes(message)) return toGrey(withBytesSwapped(message));
  try {
    return cv_bridge::toCvCopy(message, "mono8")->image;
  } catch (const cv_bridge::Exception& error) {
    throw ImageError("image cannot be converted: " + std::string(error.what()));
  } catch (const cv::Exception& error) {
    throw ImageError("image cannot be converted: " + error.err);
  }
}

cv::Mat toGrey(const sensor_msgs::CompressedImage& message) { return decodedToGrey(message.data); }

}  // namespace visual_localization

#include "visual_localization/ros/image_conversion.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <cv_bridge/cv_bridge.h>
#include <opencv2/imgcodecs.hpp>

#include "base/text.h"

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

cv::Size requireSize(std::uint64_t width, std::uint64_t height) {
  const std::string size = std::to_string(width) + "x" + std::to_string(height);
  if (width == 0 || height == 0) throw ImageError("image is empty (" + size + ")");
  const auto limit = static_cast<std::uint64_t>(kMaxImageSide_px);
  if (width > limit || height > limit) throw ImageError("image of " + size + " pixels is too large");
  return {static_cast<int>(width), static_cast<int>(height)};
}

void requireConsistent(const sensor_msgs::Image& message) {
  const Encoding& encoding = encodingOf(message.encoding);
  requireSize(message.width, message.height);
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

using Bytes = std::vector<std::uint8_t>;

bool startsWith(const Bytes& data, std::initializer_list<std::uint8_t> magic) {
  return data.size() >= magic.size() && std::equal(magic.begin(), magic.end(), data.begin());
}

std::uint64_t bigEndian(const Bytes& data, std::size_t offset, std::size_t count) {
  if (offset + count > data.size()) throw ImageError("compressed image is cut off");
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value = value * 256 + data[offset + i];
  return value;
}

bool isStartOfFrame(std::uint64_t marker) {
  return marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
}

/// Reads the size from the frame header, so that nothing is allocated for a size that nobody means.
cv::Size requireJpegSize(const Bytes& data) {
  std::size_t at = 2;
  while (true) {
    const std::uint64_t lead = bigEndian(data, at, 1);
    const std::uint64_t marker = bigEndian(data, at + 1, 1);
    if (lead != 0xFF) throw ImageError("JPEG is broken");
    if (marker == 0xFF) {
      ++at;
    } else if (isStartOfFrame(marker)) {
      return requireSize(bigEndian(data, at + 7, 2), bigEndian(data, at + 5, 2));
    } else {
      at += 2 + bigEndian(data, at + 2, 2);
    }
  }
}

/// The decoder fills what is missing of a JPEG with grey and calls it a success.
void requireJpegEnd(const Bytes& data) {
  std::size_t end = data.size();
  while (end > 2 && data[end - 1] == 0) --end;  // some cameras pad
  if (data[end - 2] != 0xFF || data[end - 1] != 0xD9) throw ImageError("JPEG is cut off");
}

cv::Size requireDecodable(const Bytes& data) {
  if (data.empty()) throw ImageError("compressed image is empty");
  if (startsWith(data, {0xFF, 0xD8, 0xFF})) {
    const cv::Size size = requireJpegSize(data);
    requireJpegEnd(data);
    return size;
  }
  if (startsWith(data, {0x89, 'P', 'N', 'G', 0x0D, 0x0A, 0x1A, 0x0A})) {
    return requireSize(bigEndian(data, 16, 4), bigEndian(data, 20, 4));
  }
  throw ImageError("compressed image is neither JPEG nor PNG");
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

cv::Size sizeOf(const sensor_msgs::CompressedImage& message) { return requireDecodable(message.data); }

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

cv::Mat toGrey(const sensor_msgs::CompressedImage& message) {
  requireDecodable(message.data);
  try {
    cv::Mat grey = cv::imdecode(message.data, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
    if (grey.empty() || grey.type() != CV_8UC1) throw ImageError("compressed image is broken");
    return grey;
  } catch (const cv::Exception& error) {
    throw ImageError("compressed image is broken: " + error.err);
  }
}

}  // namespace visual_localization

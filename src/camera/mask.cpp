#include "visual_localization/camera/mask.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <opencv2/imgproc.hpp>
#include <png.h>

#include "base/files.h"
#include "base/text.h"

namespace visual_localization {
namespace {

constexpr std::size_t kLargestFile_bytes = std::size_t{64} << 20U;
constexpr std::uint32_t kLargestSide_px = 8192;
constexpr std::size_t kSignature = 8;
constexpr char kWrongKind[] = "must be grey with 8 bits a pixel, without transparency";

std::uint32_t bigEndian(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8U | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

/// The size in pixels of a PNG by its header (https://www.w3.org/TR/png, 11.2.1), before memory is taken for it.
cv::Size sizeOfPng(const std::string& bytes) {
  constexpr std::size_t kHeader = 26;  // signature, IHDR with sides, depth and type of colour
  if (bytes.size() < kHeader || bytes.compare(0, kSignature, "\x89PNG\r\n\x1A\n") != 0 ||
      bytes.compare(12, 4, "IHDR") != 0) {
    throw CameraError("is not a PNG image");
  }
  const std::uint32_t width = bigEndian(bytes, 16);
  const std::uint32_t height = bigEndian(bytes, 20);
  if (width < 1 || height < 1 || width > kLargestSide_px || height > kLargestSide_px) {
    throw CameraError("has " + std::to_string(width) + " x " + std::to_string(height) + " pixels, at most " +
                      std::to_string(kLargestSide_px) + " x " + std::to_string(kLargestSide_px) + " are allowed");
  }
  const int depth = static_cast<unsigned char>(bytes[24]);
  const int colour = static_cast<unsigned char>(bytes[25]);
  if (depth != 8 || colour != 0) throw CameraError(kWrongKind);
  return {static_cast<int>(width), static_cast<int>(height)};
}

/// A PNG without the chunks that would change its pixels, as gamma does, or take memory, as texts do.
std::string barePng(const std::string& bytes) {
  constexpr std::size_t kAround = 12;  // length, type and checksum of a chunk
  std::string bare = bytes.substr(0, kSignature);
  for (std::size_t at = kSignature;;) {
    if (bytes.size() - at < kAround) throw CameraError("is cut off");
    const std::size_t length = bigEndian(bytes, at);
    if (length > bytes.size() - at - kAround) throw CameraError("is cut off");
    const std::string type = bytes.substr(at + 4, 4);
    if (type == "tRNS") throw CameraError(kWrongKind);
    if (type == "IHDR" || type == "IDAT" || type == "IEND") bare.append(bytes, at, length + kAround);
    if (type == "IEND") return bare;
    at += length + kAround;
  }
}

Mask decoded(const std::string& bytes) {
  cv::Mat grey(sizeOfPng(bytes), CV_8UC1);
  const std::string bare = barePng(bytes);
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (::png_image_begin_read_from_memory(&png, bare.data(), bare.size()) == 0) {
    throw CameraError("cannot be decoded: " + oneLine(png.message));
  }
  png.format = PNG_FORMAT_GRAY;
  if (::png_image_finish_read(&png, nullptr, grey.data, static_cast<png_int_32>(grey.step), nullptr) == 0) {
    throw CameraError("cannot be decoded: " + oneLine(png.message));
  }
  return Mask(grey);
}

std::string text(const cv::Size& size) { return std::to_string(size.width) + " x " + std::to_string(size.height); }

/// Whether one size is the other one, resized: to a pixel, since sides are whole numbers.
bool sameShape(const cv::Size& a, const cv::Size& b) {
  const double difference = std::abs(static_cast<double>(a.width) * b.height - static_cast<double>(b.width) * a.height);
  return difference <= std::max({a.width, a.height, b.width, b.height});
}

void requireSameShape(const cv::Size& images, const cv::Size& size, const char* what) {
  if (sameShape(images, size)) return;
  throw CameraError(std::string(what) + " is for " + text(size) + " px, but the images have " + text(images) +
                    " px: another shape");
}

}  // namespace

Mask::Mask(const cv::Mat& grey) {
  if (grey.empty() || grey.type() != CV_8UC1) throw CameraError("a mask must be grey with 8 bits a pixel");
  constexpr double kFromHere = 127.0;
  cv::threshold(grey, grey_, kFromHere, 255.0, cv::THRESH_BINARY);
  if (cv::countNonZero(grey_) == 0) throw CameraError("a mask must use some of the image: white = use");
}

bool Mask::allows(float x_px, float y_px) const {
  if (empty()) return true;
  const auto nearest = [](float at, int side) {
    return static_cast<int>(std::lround(std::clamp(at, 0.0F, static_cast<float>(side - 1))));
  };
  return grey_.at<std::uint8_t>(nearest(y_px, grey_.rows), nearest(x_px, grey_.cols)) != 0;
}

double Mask::usedShare() const {
  return empty() ? 1.0 : static_cast<double>(cv::countNonZero(grey_)) / static_cast<double>(grey_.total());
}

Mask Mask::scaledTo(const cv::Size& size) const {
  if (empty() || size == grey_.size()) return *this;
  cv::Mat scaled;
  cv::resize(grey_, scaled, size, 0.0, 0.0, cv::INTER_NEAREST);
  return Mask(scaled);
}

bool operator==(const Mask& a, const Mask& b) {
  if (a.size() != b.size()) return false;
  return a.empty() || cv::norm(a.grey(), b.grey(), cv::NORM_INF) == 0.0;
}

Mask readMask(const std::string& path) {
  try {
    return decoded(readFile(path, kLargestFile_bytes));
  } catch (const FileError& error) {
    throw CameraError(error.what());
  } catch (const cv::Exception& error) {
    throw CameraError(path + ": " + oneLine(error.err));
  } catch (const CameraError& error) {
    throw CameraError(path + ": " + error.what());
  }
}

CameraModel fittedTo(const cv::Size& images, const CameraModel& camera) {
  requireSameShape(images, camera.size(), "the calibration");
  return camera.scaledTo(images);
}

Mask fittedTo(const cv::Size& images, const Mask& mask) {
  if (!mask.empty()) requireSameShape(images, mask.size(), "the mask");
  return mask.scaledTo(images);
}

}  // namespace visual_localization

#include "visual_localization/camera/mask.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "base/files.h"
#include "base/png_reader.h"
#include "base/text.h"

namespace visual_localization {
namespace {

constexpr std::size_t kLargestFile_bytes = std::size_t{64} << 20U;
constexpr std::uint32_t kLargestSide_px = 8192;

/// The size in pixels, before memory is taken for it.
cv::Size sizeFrom(PngReader& png, const std::string& bytes) {
  if (bytes.compare(0, 8, "\x89PNG\r\n\x1A\n") != 0) throw CameraError("is not a PNG image");
  const std::string most = std::to_string(kLargestSide_px) + " x " + std::to_string(kLargestSide_px) + " are allowed";
  if (!png.readHeader()) throw CameraError("is damaged or has too many pixels, at most " + most);
  if (png.width() > kLargestSide_px || png.height() > kLargestSide_px) {
    throw CameraError("has " + std::to_string(png.width()) + " x " + std::to_string(png.height()) +
                      " pixels, at most " + most);
  }
  if (!png.isGrey() || png.bits() != 8 || png.isTransparent()) {
    throw CameraError("must be grey with 8 bits a pixel, without transparency");
  }
  return {static_cast<int>(png.width()), static_cast<int>(png.height())};
}

Mask decoded(const std::string& bytes) {
  PngReader png(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), kLargestSide_px);
  cv::Mat grey(sizeFrom(png, bytes), CV_8UC1);
  std::vector<std::uint8_t*> rows;
  for (int row = 0; row < grey.rows; ++row) rows.push_back(grey.ptr(row));
  if (!png.read(rows, 1)) throw CameraError("is damaged or cut off");
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

#include "visual_localization/features/contrast.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace visual_localization {
namespace {

constexpr double kNothing = 4.0;  ///< less is noise
constexpr double kDull = 10.0;    ///< up to here the grey levels are spread to kUsual, less and less up to kEnough
constexpr double kEnough = 20.0;
constexpr double kUsual = 40.0;
constexpr double kMiddle = 128.0;

/// Falls steadily from kDull on: of two successive images one must not be spread and the other left as it is.
double gainFor(double contrast) {
  if (contrast < kNothing || contrast >= kEnough) return 1.0;
  if (contrast <= kDull) return kUsual / contrast;
  const double largest = kUsual / kDull;
  return largest + (1.0 - largest) * (contrast - kDull) / (kEnough - kDull);
}

}  // namespace

GreyLevels greyLevelsOf(const cv::Mat& grey) {
  std::uint64_t sum = 0;
  std::uint64_t squares = 0;
  for (int row = 0; row < grey.rows; ++row) {
    const auto* pixels = grey.ptr<std::uint8_t>(row);
    for (int column = 0; column < grey.cols; ++column) {
      const std::uint64_t value = pixels[column];
      sum += value;
      squares += value * value;
    }
  }
  const auto count = static_cast<double>(std::max<std::size_t>(1, grey.total()));
  const double mean = static_cast<double>(sum) / count;
  return {mean, std::sqrt(std::max(0.0, static_cast<double>(squares) / count - mean * mean))};
}

const cv::Mat& withUsualContrast(const cv::Mat& grey, const GreyLevels& levels, cv::Mat& buffer) {
  const double gain = gainFor(levels.contrast);
  if (gain == 1.0) return grey;
  const double spread = std::min(1.0, (gain - 1.0) / (kUsual / kDull - 1.0));
  const double mean = levels.mean + spread * (kMiddle - levels.mean);
  grey.convertTo(buffer, CV_8U, gain, mean - gain * levels.mean);
  return buffer;
}

}  // namespace visual_localization

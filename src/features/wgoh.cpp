#include <cmath>
#include <cstdlib>

#include "features/global_histograms.h"

namespace visual_localization {
namespace {

constexpr double kRelativeStd = 0.5;  ///< of the Gaussian, in sides of a subimage

/// The multiple of 45 degrees nearest to the direction (dx, dy); no branches and no trigonometry, so that the compiler
/// can take several pixels at once. No whole numbers lie exactly between two.
int nearestOctant(int dx, int dy) {
  constexpr float kTan22 = 0.41421356F;  // of 22.5 degrees
  const auto width = static_cast<float>(std::abs(dx));
  const auto height = static_cast<float>(std::abs(dy));
  const int horizontal = dx < 0 ? 4 : 0;
  const int vertical = dy < 0 ? 6 : 2;
  const int right = dy < 0 ? 7 : 1;
  const int left = dy < 0 ? 5 : 3;
  const int diagonal = dx < 0 ? left : right;
  const int steep = width < kTan22 * height ? vertical : diagonal;
  return height < kTan22 * width ? horizontal : steep;
}

}  // namespace

GlobalFeatures::Histogram Wgoh::extract(const cv::Mat& grey) {
  if (grey.size() != image_size_) prepare(grey.size());
  GlobalFeatures::Histogram histogram{};
  for (int y = 1; y + 1 < grey.rows; ++y) {
    findGradients(grey.ptr<std::uint8_t>(y - 1), grey.ptr<std::uint8_t>(y), grey.ptr<std::uint8_t>(y + 1));
    grid_.addRow(y, 1, grey.cols - 1, magnitudes_.data(), bins_.data(), histogram);
  }
  return histogram;
}

void Wgoh::prepare(cv::Size image_size) {
  grid_ = SubimageGrid(image_size, kRelativeStd);
  magnitudes_.assign(static_cast<std::size_t>(image_size.width), 0.0F);
  bins_.assign(static_cast<std::size_t>(image_size.width), 0);
  image_size_ = image_size;
}

void Wgoh::findGradients(const std::uint8_t* above, const std::uint8_t* here, const std::uint8_t* below) {
  float* magnitudes = magnitudes_.data();
  std::uint8_t* bins = bins_.data();
  const std::size_t end = bins_.size() - 1;
  for (std::size_t x = 1; x < end; ++x) {
    const int dx = here[x + 1] - here[x - 1];
    const int dy = below[x] - above[x];
    magnitudes[x] = std::sqrt(static_cast<float>(dx * dx + dy * dy));
    bins[x] = static_cast<std::uint8_t>(nearestOctant(dx, dy));
  }
}

}  // namespace visual_localization

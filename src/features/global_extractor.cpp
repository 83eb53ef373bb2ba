#include "visual_localization/features/global_extractor.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "visual_localization/features/sift_extractor.h"
#include "visual_localization/geo/angles.h"

namespace visual_localization {
namespace {

constexpr double kOrientationStd = 0.5;  ///< of the Gaussian, in sides of a subimage (Weiss et al., section II.A)
constexpr double kInvariantStd = 0.25;   ///< the same for WGII (section II.B)
constexpr int kRotations = 10;           ///< q
constexpr double kRadius1_px = 10.0;     ///< p1 = (10, 0)
constexpr double kRadius2_px = 20.0;     ///< p2 = (0, 20)
constexpr float kEpsilon = 0.098F;       ///< of the relational kernel, on intensities in [0, 1]
constexpr int kReach_px = 21;            ///< of the farthest sample and its bilinear neighbours
constexpr float kIntensity = 1.0F / 255.0F;

/// Bilinear sampling at a constant offset from every pixel: four taps with constant weights.
struct Sample {
  int x_px = 0;
  int y_px = 0;
  std::array<float, 4> weights{};  ///< of (x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)

  Sample(double dx_px, double dy_px) {
    constexpr double kOnPixel = 1e-9;  // cos and sin miss the whole pixels by a rounding error
    x_px = static_cast<int>(std::floor(dx_px + kOnPixel));
    y_px = static_cast<int>(std::floor(dy_px + kOnPixel));
    const double fx = std::max(0.0, dx_px - x_px);
    const double fy = std::max(0.0, dy_px - y_px);
    weights = {static_cast<float>((1.0 - fx) * (1.0 - fy)), static_cast<float>(fx * (1.0 - fy)),
               static_cast<float>((1.0 - fx) * fy), static_cast<float>(fx * fy)};
  }
};

/// R_k p1 and R_k p2.
struct SamplePair {
  Sample first;
  Sample second;
};

const std::vector<SamplePair>& rotatedSamples() {
  static const std::vector<SamplePair> samples = [] {
    std::vector<SamplePair> all;
    for (int k = 0; k < kRotations; ++k) {
      const double angle_rad = 2.0 * kPi * k / kRotations;
      const double c = std::cos(angle_rad);
      const double s = std::sin(angle_rad);
      all.push_back({Sample(kRadius1_px * c, kRadius1_px * s), Sample(-kRadius2_px * s, kRadius2_px * c)});
    }
    return all;
  }();
  return samples;
}

/// The row of `image` that a sample reads for its row `y`, and the one below, from its column `x` on.
struct Taps {
  const float* upper;
  const float* lower;
  std::array<float, 4> weights;

  Taps(const cv::Mat& image, int x, int y, const Sample& sample)
      : upper(image.ptr<float>(y + sample.y_px) + x + sample.x_px),
        lower(image.ptr<float>(y + sample.y_px + 1) + x + sample.x_px),
        weights(sample.weights) {}

  float at(std::size_t i) const {
    return weights[0] * upper[i] + weights[1] * upper[i + 1] + weights[2] * lower[i] + weights[3] * lower[i + 1];
  }
};

/// Adds rel(I(x + p1) - I(x + p2)) for `count` pixels: 1 below -epsilon, 0 above epsilon, linear between.
void addRelations(const Taps& first, const Taps& second, std::size_t count, float* sums) {
  constexpr float kSlope = 0.5F / kEpsilon;
  for (std::size_t i = 0; i < count; ++i) {
    const float relation = 0.5F - kSlope * (first.at(i) - second.at(i));
    sums[i] += std::min(1.0F, std::max(0.0F, relation));
  }
}

/// Which eighth of the circle the direction (dx, dy) lies in, without trigonometry; eighth k begins at k * 45 degrees.
std::uint8_t octantOf(float dx, float dy) {
  const bool below = dy < 0.0F || (dy == 0.0F && dx < 0.0F);  // [180, 360)
  const float x = below ? -dx : dx;
  const float y = below ? -dy : dy;  // now in [0, 180)
  const int octant = x > 0.0F ? (y < x ? 0 : 1) : (y > -x ? 2 : 3);
  return static_cast<std::uint8_t>(octant + (below ? 4 : 0));
}

}  // namespace

GlobalFeatures GlobalExtractor::extract(const cv::Mat& grey) {
  requireExtractable(grey);
  if (grey.size() != image_size_) prepare(grey.size());
  grey.convertTo(image_, CV_32F, static_cast<double>(kIntensity));
  GlobalFeatures features;
  addGradients(features.wgoh);
  if (continued_) cv::copyMakeBorder(image_, image_, kReach_px, kReach_px, kReach_px, kReach_px, cv::BORDER_REPLICATE);
  addInvariants(features.wgii);
  normalise(features.wgoh);
  normalise(features.wgii);
  return features;
}

void GlobalExtractor::prepare(cv::Size image_size) {
  image_size_ = image_size;
  wgoh_grid_ = SubimageGrid(image_size, kOrientationStd);
  wgii_grid_ = SubimageGrid(image_size, kInvariantStd);
  continued_ = std::min(image_size.width, image_size.height) < 4 * kReach_px;
  const auto width = static_cast<std::size_t>(image_size.width);
  sums_.assign(width, 0.0F);
  values_.assign(width, 0.0F);
  bins_.assign(width, 0);
}

void GlobalExtractor::addGradients(GlobalFeatures::Histogram& histogram) {
  for (int y = 1; y + 1 < image_size_.height; ++y) {
    const float* above = image_.ptr<float>(y - 1);
    const float* here = image_.ptr<float>(y);
    const float* below = image_.ptr<float>(y + 1);
    for (std::size_t x = 1; x + 1 < values_.size(); ++x) {
      const float dx = here[x + 1] - here[x - 1];
      const float dy = below[x] - above[x];
      values_[x] = std::sqrt(dx * dx + dy * dy);
      bins_[x] = octantOf(dx, dy);
    }
    wgoh_grid_.addRow(y, 1, image_size_.width - 1, values_.data(), bins_.data(), histogram);
  }
}

void GlobalExtractor::addInvariants(GlobalFeatures::Histogram& histogram) {
  const int margin_px = continued_ ? 0 : kReach_px;  // pixels at the border that do not count
  const int shift_px = continued_ ? kReach_px : 0;   // of the image in its continuation
  const int end = image_size_.width - margin_px;
  const auto count = static_cast<std::size_t>(end - margin_px);
  constexpr float kScale = static_cast<float>(GlobalFeatures::kBins) / kRotations;
  constexpr float kRounding = 1e-4F;  // plain surfaces lie exactly between two bins: all of them go to the upper one
  std::fill(values_.begin(), values_.end(), 1.0F);
  for (int y = margin_px; y < image_size_.height - margin_px; ++y) {
    std::fill_n(sums_.begin(), count, 0.0F);
    for (const SamplePair& pair : rotatedSamples()) {
      addRelations(Taps(image_, margin_px + shift_px, y + shift_px, pair.first),
                   Taps(image_, margin_px + shift_px, y + shift_px, pair.second), count, sums_.data());
    }
    for (std::size_t i = 0; i < count; ++i) {
      constexpr int kLastBin = static_cast<int>(GlobalFeatures::kBins) - 1;
      bins_[i + static_cast<std::size_t>(margin_px)] =
          static_cast<std::uint8_t>(std::min(kLastBin, static_cast<int>(sums_[i] * kScale + kRounding)));
    }
    wgii_grid_.addRow(y, margin_px, end, values_.data(), bins_.data(), histogram);
  }
}

}  // namespace visual_localization

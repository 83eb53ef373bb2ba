#include "visual_localization/features/global_features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <numeric>

#include <opencv2/imgproc.hpp>

#include "base/numbers.h"
#include "features/global_histograms.h"
#include "visual_localization/features/local_features.h"

namespace visual_localization {
namespace {

constexpr double kWgohRelativeStd = 0.5;  ///< of the Gaussian, in sides of a subimage

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

constexpr double kWgiiRelativeStd = 0.25;  ///< of the Gaussian, in sides of a subimage
constexpr int kRotations = 10;             ///< q
constexpr double kRadius1Px = 10.0;        ///< p1 = (10, 0)
constexpr double kRadius2Px = 20.0;        ///< p2 = (0, 20)
constexpr int kReachPx = 20;               ///< of the farthest sample and the pixels it is interpolated from
constexpr int kSmallestSidePx = 160;       ///< where the centres of the outer subimages are so far from the border
constexpr int kGreyLevel = 128;            ///< one of the 256 grey levels; any larger, and differences need 17 bits
constexpr int kEpsilon = 3199;             ///< 0.098 of full intensity: 0.098 * 255 * kGreyLevel, rounded
constexpr int kTie = 32;                   ///< more than a sum over the rotations is off: 8 of them by up to 3 each

/// A number between `a` and `b`, at weight / 65536 of the way, rounded down: 1.25 too small to 0.25 too large, the
/// rounding of the weight included. Shift a and b, and it is shifted by the same.
std::int16_t between(std::int16_t a, std::int16_t b, std::int16_t weight) {
  const auto step = static_cast<std::int16_t>(b - a);
  return static_cast<std::int16_t>(a + ((step * weight) >> 16));
}

/// One axis of a sample at a constant offset from every pixel: the nearest whole pixel and the next in its direction.
struct Interpolation {
  int nearest_px = 0;
  int step_px = 0;          ///< +1 or -1
  std::int16_t weight = 0;  ///< of the next, at most one half

  explicit Interpolation(double offset_px) : nearest_px(static_cast<int>(std::lround(offset_px))) {
    const double rest_px = offset_px - nearest_px;
    weight = static_cast<std::int16_t>(std::min(std::lround(std::abs(rest_px) * 65536.0), 32767L));
    step_px = rest_px > 0.0 ? 1 : -1;
    if (weight == 0) step_px = nearest_px > 0 ? -1 : 1;  // without weight it only must not leave the image
  }
};

/// What rotates around the pixel.
struct Sample {
  Interpolation x;
  Interpolation y;
};

/// R_k p1 and R_k p2.
struct SamplePair {
  Sample first;
  Sample second;
};

std::vector<SamplePair> rotatedSamples() {
  std::vector<SamplePair> samples;
  for (int k = 0; k < kRotations; ++k) {
    const double c = std::cos(2.0 * kPi * k / kRotations);
    const double s = std::sin(2.0 * kPi * k / kRotations);
    samples.push_back({{Interpolation(kRadius1Px * c), Interpolation(kRadius1Px * s)},
                       {Interpolation(-kRadius2Px * s), Interpolation(kRadius2Px * c)}});
  }
  return samples;
}

/// A sample for the pixels of one row, from its column `x` on.
struct SampledRow {
  const std::int16_t* here;  ///< nearest in both axes
  const std::int16_t* beside;
  const std::int16_t* above;  ///< or below
  const std::int16_t* across;
  std::int16_t x_weight;
  std::int16_t y_weight;

  SampledRow(const cv::Mat& levels, int x, int y, const Sample& sample)
      : here(levels.ptr<std::int16_t>(y + sample.y.nearest_px) + x + sample.x.nearest_px),
        beside(here + sample.x.step_px),
        above(levels.ptr<std::int16_t>(y + sample.y.nearest_px + sample.y.step_px) + x + sample.x.nearest_px),
        across(above + sample.x.step_px),
        x_weight(sample.x.weight),
        y_weight(sample.y.weight) {}

  std::int16_t at(std::size_t i) const {
    return between(between(here[i], beside[i], x_weight), between(above[i], across[i], x_weight), y_weight);
  }
};

/// Adds I(x + p2) - I(x + p1), limited to epsilon: rel is linear in that, 0 at -epsilon and 1 at epsilon.
void addRelations(SampledRow first, SampledRow second, std::size_t count, std::int16_t* sums) {
  constexpr auto kLimit = static_cast<std::int16_t>(kEpsilon);
  for (std::size_t i = 0; i < count; ++i) {
    const auto difference = static_cast<std::int16_t>(second.at(i) - first.at(i));
    const std::int16_t upper = std::min(difference, kLimit);
    sums[i] = static_cast<std::int16_t>(sums[i] + std::max(upper, static_cast<std::int16_t>(-kLimit)));
  }
}

/// Bins of the mean of rel, from the sum of the limited differences. Plain and evenly sloping surfaces are at exactly
/// 0.5, between two bins; kTie sends all of them into the upper one, whatever the error of their sum.
void binRelations(const std::int16_t* sums, std::size_t count, std::uint8_t* bins) {
  constexpr std::uint32_t kRange = 2U * kRotations * kEpsilon;
  constexpr auto kPerBin = static_cast<std::uint32_t>((1U << 28U) * GlobalFeatures::kBins / kRange + 1);
  constexpr int kLast = GlobalFeatures::kBins - 1;
  for (std::size_t i = 0; i < count; ++i) {
    const auto positive = static_cast<std::uint16_t>(sums[i] + kRotations * kEpsilon + kTie);
    const auto scaled = static_cast<std::uint16_t>((positive * kPerBin) >> 16U);
    bins[i] = static_cast<std::uint8_t>(std::min(scaled >> 12U, kLast));
  }
}

}  // namespace

double histogramIntersection(const GlobalFeatures::Histogram& query, const GlobalFeatures::Histogram& training) {
  // Sums in lanes, so that the compiler may add four at once.
  constexpr std::size_t kLanes = 4;
  std::array<float, kLanes> common{};
  std::array<float, kLanes> all{};
  for (std::size_t i = 0; i < query.size(); i += kLanes) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      common[lane] += std::min(query[i + lane], training[i + lane]);
      all[lane] += query[i + lane];
    }
  }
  const double total = std::accumulate(all.begin(), all.end(), 0.0);
  return total > 0.0 ? std::accumulate(common.begin(), common.end(), 0.0) / total : 0.0;
}

SubimageGrid::SubimageGrid(cv::Size image_size, double relative_std)
    : columns_(axis(image_size.width, relative_std)), rows_(axis(image_size.height, relative_std)) {}

SubimageGrid::Axis SubimageGrid::axis(int length_px, double relative_std) {
  const double side_px = static_cast<double>(length_px) / GlobalFeatures::kGridSide;
  Axis axis;
  for (int i = 0; i < length_px; ++i) {
    const double centre_px = i + 0.5;
    const auto subimage = std::min(GlobalFeatures::kGridSide - 1, static_cast<std::size_t>(centre_px / side_px));
    const double offset = centre_px / side_px - (static_cast<double>(subimage) + 0.5);
    axis.subimage.push_back(subimage);
    axis.weight.push_back(static_cast<float>(std::exp(-0.5 * offset * offset / (relative_std * relative_std))));
  }
  return axis;
}

void SubimageGrid::addRow(int row, int begin, int end, const float* values, const std::uint8_t* bins,
                          GlobalFeatures::Histogram& histogram) const {
  constexpr std::size_t kRowOfSubimages = GlobalFeatures::kGridSide * GlobalFeatures::kBins;
  std::array<float, kRowOfSubimages> sums{};  // without the row's weight, which is common to all its pixels
  const auto last = static_cast<std::size_t>(std::max(begin, end));
  for (auto x = static_cast<std::size_t>(begin); x < last; ++x) {
    sums[columns_.subimage[x] * GlobalFeatures::kBins + bins[x]] += values[x] * columns_.weight[x];
  }
  const auto y = static_cast<std::size_t>(row);
  float* to = &histogram[rows_.subimage[y] * kRowOfSubimages];
  for (std::size_t i = 0; i < kRowOfSubimages; ++i) to[i] += rows_.weight[y] * sums[i];
}

void normalise(GlobalFeatures::Histogram& histogram) {
  const float total = std::accumulate(histogram.begin(), histogram.end(), 0.0F);
  if (!(total > 0.0F)) return;
  for (float& value : histogram) value /= total;
}

struct GlobalExtractor::Histograms {
  Wgoh wgoh;
  Wgii wgii;
};

GlobalExtractor::GlobalExtractor() : histograms_(std::make_unique<Histograms>()) {}
GlobalExtractor::~GlobalExtractor() = default;
GlobalExtractor::GlobalExtractor(GlobalExtractor&&) noexcept = default;
GlobalExtractor& GlobalExtractor::operator=(GlobalExtractor&&) noexcept = default;

GlobalFeatures GlobalExtractor::extract(const cv::Mat& grey) {
  requireExtractable(grey);
  GlobalFeatures features{histograms_->wgoh.extract(grey), histograms_->wgii.extract(grey)};
  normalise(features.wgoh);
  normalise(features.wgii);
  return features;
}

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
  grid_ = SubimageGrid(image_size, kWgohRelativeStd);
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

GlobalFeatures::Histogram Wgii::extract(const cv::Mat& grey) {
  if (grey.size() != image_size_) prepare(grey.size());
  findLevels(grey);
  GlobalFeatures::Histogram histogram{};
  for (int y = margin_px_; y < image_size_.height - margin_px_; ++y) {
    findBins(y);
    grid_.addRow(y, margin_px_, image_size_.width - margin_px_, ones_.data(), bins_.data(), histogram);
  }
  return histogram;
}

void Wgii::prepare(cv::Size image_size) {
  grid_ = SubimageGrid(image_size, kWgiiRelativeStd);
  margin_px_ = std::min(image_size.width, image_size.height) < kSmallestSidePx ? 0 : kReachPx;
  const auto width = static_cast<std::size_t>(image_size.width);
  sums_.assign(width - 2 * static_cast<std::size_t>(margin_px_), 0);
  ones_.assign(width, 1.0F);
  bins_.assign(width, 0);
  image_size_ = image_size;
}

void Wgii::findLevels(const cv::Mat& grey) {
  const int added_px = kReachPx - margin_px_;
  if (added_px > 0) {
    cv::copyMakeBorder(grey, continued_, added_px, added_px, added_px, added_px,
                       cv::BORDER_REPLICATE | cv::BORDER_ISOLATED);
  }
  const cv::Mat& image = added_px > 0 ? continued_ : grey;
  levels_.create(image.size(), CV_16SC1);
  for (int y = 0; y < image.rows; ++y) {
    const auto* from = image.ptr<std::uint8_t>(y);
    auto* to = levels_.ptr<std::int16_t>(y);
    for (int x = 0; x < image.cols; ++x) to[x] = static_cast<std::int16_t>(from[x] * kGreyLevel);
  }
}

void Wgii::findBins(int row) {
  static const std::vector<SamplePair> kSamples = rotatedSamples();
  std::fill(sums_.begin(), sums_.end(), std::int16_t{0});
  const int y = row + kReachPx - margin_px_;  // in levels_
  for (const SamplePair& pair : kSamples) {
    addRelations(SampledRow(levels_, kReachPx, y, pair.first), SampledRow(levels_, kReachPx, y, pair.second),
                 sums_.size(), sums_.data());
  }
  binRelations(sums_.data(), sums_.size(), bins_.data() + margin_px_);
}

}  // namespace visual_localization

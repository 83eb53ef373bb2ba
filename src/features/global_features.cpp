#include "visual_localization/features/global_features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "features/global_histograms.h"
#include "visual_localization/features/sift_extractor.h"

namespace visual_localization {

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

}  // namespace visual_localization

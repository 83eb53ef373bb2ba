#include "visual_localization/features/sift_scale_space.h"

#include <algorithm>
#include <cmath>

namespace visual_localization {
namespace {

constexpr double kCameraBlur_px = 0.5;  ///< Lowe 2004, section 3.3: what an image is assumed to have

/// Blur from one level to the next: variances add up.
double stepSigma(double from_px, double to_px) { return std::sqrt(to_px * to_px - from_px * from_px); }

std::vector<GaussianKernel> kernelsFor(const SiftConfig& config) {
  constexpr double kLeastVariance = 0.01;
  const double doubled_px = 2.0 * kCameraBlur_px;
  const double variance = config.sigma_px * config.sigma_px - doubled_px * doubled_px;
  std::vector<GaussianKernel> kernels{GaussianKernel(std::sqrt(std::max(variance, kLeastVariance)))};
  const double factor = std::pow(2.0, 1.0 / config.octave_layers);
  for (int level = 1; level < config.octave_layers + 3; ++level) {
    const double sigma_px = config.sigma_px * std::pow(factor, level - 1);
    kernels.emplace_back(stepSigma(sigma_px, sigma_px * factor));
  }
  return kernels;
}

/// Every second pixel of every second row.
void halve(const FloatPlane& from, FloatPlane& to) {
  for (int y = 0; y < to.height(); ++y) {
    const float* in = from.row(2 * y);
    float* out = to.row(y);
    for (int x = 0; x < to.width(); ++x) out[x] = in[2 * x];
  }
}

/// Linear interpolation at a quarter of a pixel, `from` nearer than `beside`.
float between(int nearer, int beside) {
  return 0.75F * static_cast<float>(nearer) + 0.25F * static_cast<float>(beside);
}

}  // namespace

SiftScaleSpace::SiftScaleSpace(const SiftConfig& config) : kernels_(kernelsFor(config)), rows_done_(kernels_.size()) {}

void SiftScaleSpace::setImage(const cv::Mat& grey) {
  grey_ = grey;
  doubled_.resize(2 * grey.cols, 2 * grey.rows);
  doubled_rows_ = 0;
  // OpenCV's number of octaves, less those that are all border.
  const int smaller = std::min(doubled_.width(), doubled_.height());
  const auto most = static_cast<std::size_t>(std::lrint(std::log2(static_cast<double>(smaller)) - 2.0) + 1);
  int width = doubled_.width();
  int height = doubled_.height();
  octave_count_ = 0;
  while (octave_count_ < most && std::min(width, height) > 2 * kBorder) {
    if (octaves_.size() == octave_count_) octaves_.emplace_back();
    SiftOctave& octave = octaves_[octave_count_++];
    octave.levels.resize(kernels_.size());
    for (FloatPlane& level : octave.levels) level.resize(width, height);
    width /= 2;
    height /= 2;
  }
}

void SiftScaleSpace::begin(std::size_t i) {
  current_ = i;
  std::fill(rows_done_.begin(), rows_done_.end(), 0);
  if (i == 0) return;
  const std::vector<FloatPlane>& before = octaves_[i - 1].levels;
  halve(before[before.size() - 3], octaves_[i].levels.front());  // that of twice the first one's blur
  rows_done_.front() = octaves_[i].height();
}

int SiftScaleSpace::advance() {
  const int before = rows_done_.back();
  while (rows_done_.back() == before && before < octaves_[current_].height()) {
    for (std::size_t level = 0; level < rows_done_.size(); ++level) advanceLevel(level);
  }
  return rows_done_.back();
}

bool SiftScaleSpace::advanceLevel(std::size_t level) {
  std::vector<FloatPlane>& levels = octaves_[current_].levels;
  const int height = levels.front().height();
  const int first = rows_done_[level];
  const int last = std::min(height, first + kStrip);
  const int needed = std::min(height, last + kernels_[level].radius());
  if (first == height) return false;
  if (level == 0) {
    doubleRows(needed);
  } else if (rows_done_[level - 1] < needed) {
    return false;
  }
  blur_.blurRows(level == 0 ? doubled_ : levels[level - 1], kernels_[level], first, last, levels[level]);
  rows_done_[level] = last;
  return true;
}

void SiftScaleSpace::doubleRows(int last_row) {
  for (; doubled_rows_ < last_row; ++doubled_rows_) {
    const int y = doubled_rows_ / 2;
    const int other = std::clamp(doubled_rows_ % 2 == 0 ? y - 1 : y + 1, 0, grey_.rows - 1);
    const std::uint8_t* near_row = grey_.ptr<std::uint8_t>(y);
    const std::uint8_t* far_row = grey_.ptr<std::uint8_t>(other);
    float* out = doubled_.row(doubled_rows_);
    const int last = grey_.cols - 1;
    const auto column = [&](int x) { return between(near_row[x], far_row[x]); };
    float before = column(0);
    float here = before;
    for (int x = 0; x <= last; ++x) {
      const float after = column(std::min(x + 1, last));
      out[2 * x] = 0.25F * before + 0.75F * here;
      out[2 * x + 1] = 0.75F * here + 0.25F * after;
      before = here;
      here = after;
    }
  }
}

}  // namespace visual_localization

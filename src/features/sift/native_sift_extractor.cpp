#include "features/sift/native_sift_extractor.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <tuple>

#include "features/sift/extrema.h"
#include "features/sift/scale_space.h"

namespace visual_localization {
namespace {

constexpr double kCameraBlurPx = 0.5;  ///< Lowe 2004, section 3.3: what an image is assumed to have

/// Blur from one level to the next: variances add up.
double stepSigma(double from_px, double to_px) { return std::sqrt(to_px * to_px - from_px * from_px); }

DoublingKernel firstKernel(const SiftConfig& config) {
  constexpr double kLeastVariance = 0.01;
  const double doubled_px = 2.0 * kCameraBlurPx;
  const double variance = config.sigma_px * config.sigma_px - doubled_px * doubled_px;
  return DoublingKernel(std::sqrt(std::max(variance, kLeastVariance)));
}

std::vector<GaussianKernel> kernelsFor(const SiftConfig& config) {
  std::vector<GaussianKernel> kernels;
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
    for (int x = 0; x < to.width(); ++x) out[x] = in[2 * static_cast<std::ptrdiff_t>(x)];
  }
}

/// Pixels of the image to a pixel of the octave: the first one is doubled.
float pixelsOf(int octave) { return std::ldexp(0.5F, octave); }

Keypoint keypointOf(const SiftPoint& point) {
  const float px = pixelsOf(point.octave);
  return {point.x_px * px, point.y_px * px, 2.0F * point.sigma_px * px, point.angle_deg};
}

/// What makes two points the same feature; larger ones first where several are at the same position.
auto identity(const SiftPoint& point) {
  const Keypoint keypoint = keypointOf(point);
  return std::make_tuple(keypoint.x_px, keypoint.y_px, -keypoint.size_px, keypoint.angle_deg);
}

void sortAndRemoveDuplicates(std::vector<SiftPoint>& points) {
  std::sort(points.begin(), points.end(), [](const SiftPoint& a, const SiftPoint& b) {
    return std::tuple_cat(identity(a), std::make_tuple(-a.response, -a.octave)) <
           std::tuple_cat(identity(b), std::make_tuple(-b.response, -b.octave));
  });
  const auto same = [](const SiftPoint& a, const SiftPoint& b) { return identity(a) == identity(b); };
  points.erase(std::unique(points.begin(), points.end(), same), points.end());
}

}  // namespace

SiftScaleSpace::SiftScaleSpace(const SiftConfig& config)
    : first_kernel_(firstKernel(config)), kernels_(kernelsFor(config)), rows_done_(kernels_.size() + 1) {}

void SiftScaleSpace::setImage(const cv::Mat& grey) {
  grey_.resize(grey.cols, grey.rows);
  for (int y = 0; y < grey.rows; ++y) std::copy_n(grey.ptr<std::uint8_t>(y), grey.cols, grey_.row(y));
  int width = 2 * grey.cols;
  int height = 2 * grey.rows;
  // OpenCV's number of octaves, less those that are all border.
  const int smaller = std::min(width, height);
  const auto most = static_cast<std::size_t>(std::lrint(std::log2(static_cast<double>(smaller)) - 2.0) + 1);
  octave_count_ = 0;
  while (octave_count_ < most && std::min(width, height) > 2 * kBorder) {
    if (octaves_.size() == octave_count_) octaves_.emplace_back();
    SiftOctave& octave = octaves_[octave_count_++];
    octave.levels.resize(rows_done_.size());
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

void SiftScaleSpace::advanceLevel(std::size_t level) {
  std::vector<FloatPlane>& levels = octaves_[current_].levels;
  const int height = levels.front().height();
  const int first = rows_done_[level];
  const int last = std::min(height, first + kStrip);
  if (first == height) return;
  if (level == 0) {
    blur_.doubleRows(grey_, first_kernel_, first, last, levels.front());
  } else {
    const GaussianKernel& kernel = kernels_[level - 1];
    if (rows_done_[level - 1] < std::min(height, last + kernel.radius())) return;
    blur_.blurRows(levels[level - 1], kernel, first, last, levels[level]);
  }
  rows_done_[level] = last;
}

NativeSiftExtractor::NativeSiftExtractor(const SiftConfig& config)
    : config_(config), scale_space_(config), search_(config), describer_(config.hellinger) {}

void NativeSiftExtractor::extract(const cv::Mat& grey, LocalFeatures& features) {
  requireExtractable(grey);
  scale_space_.setImage(grey);
  detect();
  keypoints_.clear();
  descriptors_.resize(points_.size() * kSiftDimension);
  std::uint8_t* descriptor = descriptors_.data();
  for (const SiftPoint& point : points_) {
    keypoints_.push_back(keypointOf(point));
    const SiftOctave& octave = scale_space_.octave(static_cast<std::size_t>(point.octave));
    describer_.describe(octave.levels[static_cast<std::size_t>(point.level)], point, descriptor);
    descriptor += kSiftDimension;
  }
  features.swapIn(keypoints_, descriptors_);
}

void NativeSiftExtractor::detect() {
  points_.clear();
  for (std::size_t octave = 0; octave < scale_space_.octaves(); ++octave) detectIn(octave);
  sortAndRemoveDuplicates(points_);
  keepStrongest();
}

void NativeSiftExtractor::detectIn(std::size_t octave_index) {
  const SiftOctave& octave = scale_space_.octave(octave_index);
  extrema_.clear();
  scale_space_.begin(octave_index);
  search_.begin(octave.width());
  for (int rows = 0; rows < octave.height();) {
    rows = scale_space_.advance();
    search_.search(octave, rows, extrema_);
  }
  for (const SiftExtremum& extremum : extrema_) {
    const auto point = refine(octave, static_cast<int>(octave_index), extremum, config_);
    if (!point) continue;
    if (config_.upright) {
      points_.push_back(*point);
    } else {
      orientations_.assign(octave.levels[static_cast<std::size_t>(point->level)], *point, points_);
    }
  }
}

/// As in OpenCV, all features that are as strong as the weakest one kept are kept too.
void NativeSiftExtractor::keepStrongest() {
  const auto most = static_cast<std::size_t>(config_.mostFeatures());
  if (points_.size() <= most) return;
  responses_.clear();
  for (const SiftPoint& point : points_) responses_.push_back(point.response);
  const auto weakest = responses_.begin() + static_cast<std::ptrdiff_t>(most - 1);
  std::nth_element(responses_.begin(), weakest, responses_.end(), std::greater<>());
  const float least = *weakest;
  const auto is_weak = [least](const SiftPoint& point) { return point.response < least; };
  points_.erase(std::remove_if(points_.begin(), points_.end(), is_weak), points_.end());
}

}  // namespace visual_localization

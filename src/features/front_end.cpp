#include "visual_localization/features/front_end.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "base/time.h"
#include "visual_localization/features/feature_matcher.h"

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

/// To the last bit; of two images of a camera it looks at the first few pixels only.
bool areIdentical(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size()) return false;
  for (int row = 0; row < a.rows; ++row) {
    const auto* pixels = a.ptr<std::uint8_t>(row);
    if (!std::equal(pixels, pixels + a.cols, b.ptr<std::uint8_t>(row))) return false;
  }
  return true;
}

}  // namespace

GreyLevels greyLevelsOf(const cv::Mat& grey, const Mask& mask) {
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(grey, mean, deviation, mask.grey());
  return {mean[0], deviation[0]};
}

const cv::Mat& withUsualContrast(const cv::Mat& grey, const GreyLevels& levels, cv::Mat& buffer) {
  const double gain = gainFor(levels.contrast);
  if (gain == 1.0) return grey;
  const double spread = std::min(1.0, (gain - 1.0) / (kUsual / kDull - 1.0));
  const double mean = levels.mean + spread * (kMiddle - levels.mean);
  grey.convertTo(buffer, CV_8U, gain, mean - gain * levels.mean);
  return buffer;
}

const cv::Mat& withoutMasked(const cv::Mat& grey, const Mask& mask, cv::Mat& buffer) {
  if (mask.empty()) return grey;
  buffer.create(grey.size(), CV_8U);
  buffer.setTo(kMiddle);
  grey.copyTo(buffer, mask.grey());
  return buffer;
}

void dropMasked(const Mask& mask, LocalFeatures& features) {
  if (mask.empty()) return;
  std::vector<std::size_t> used;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const Keypoint& keypoint = features.keypoints()[i];
    if (mask.allows(keypoint.x_px, keypoint.y_px)) used.push_back(i);
  }
  if (used.size() < features.size()) features = features.subset(used);
}

FrontEnd::FrontEnd(const FrontEndConfig& config)
    : config_(config), local_extractor_(config.kind->makeExtractor(config.model)) {}

void FrontEnd::configure(const FrontEndConfig& config) {
  config_.match = config.match;
  config_.prune = config.prune;
  config_.max_image_gap_s = config.max_image_gap_s;
  config_.mask = config.mask;
  has_pruned_ = false;
}

void FrontEnd::setImage(std::int64_t stamp_ns, const cv::Mat& grey) {
  const Stopwatch stopwatch;
  requireExtractable(grey);
  const cv::Mat& fitting = fitted(grey, config_.image_size, resized_);
  const GreyLevels levels = greyLevelsOf(fitting, config_.mask);
  const cv::Mat& image = withUsualContrast(fitting, levels, spread_);
  is_repeated_ = current_ && areIdentical(image, current_->grey);
  if (!is_repeated_) takeImage(image);
  current_->stamp_ns = stamp_ns;
  statistics_ = {levels.mean, levels.contrast, stretchOf(config_.image_size, grey.size())};
  extract_ms_ = stopwatch.elapsed_ms();
}

void FrontEnd::takeImage(const cv::Mat& image) {
  std::swap(previous_, current_);
  if (!current_) current_ = Image{};
  image.copyTo(current_->grey);
  current_->has_local = false;
  has_pruned_ = false;
  global_.reset();
}

const LocalFeatures& FrontEnd::local() {
  if (has_pruned_) return pruned_;
  const Stopwatch stopwatch;
  const LocalFeatures& all = unprunedLocal(*current_);
  constexpr std::size_t kLeast = 2;  // an image without features confirms nothing
  const bool prunable = config_.prune && previousIsClose() && unprunedLocal(*previous_).size() >= kLeast;
  if (prunable) {
    keepSeenIn(all, previous_->local, config_.match.max_angle_ratio, pruned_);
  } else {
    pruned_ = all;
  }
  has_pruned_ = true;
  extract_ms_ += stopwatch.elapsed_ms();
  return pruned_;
}

const GlobalFeatures& FrontEnd::global() {
  if (global_) return *global_;
  const Stopwatch stopwatch;
  global_ = global_extractor_.extract(withoutMasked(current_->grey, config_.mask, masked_));
  extract_ms_ += stopwatch.elapsed_ms();
  return *global_;
}

const LocalFeatures& FrontEnd::unprunedLocal() {
  const Stopwatch stopwatch;
  const LocalFeatures& all = unprunedLocal(*current_);
  extract_ms_ += stopwatch.elapsed_ms();
  return all;
}

const LocalFeatures& FrontEnd::unprunedLocal(Image& image) {
  if (image.has_local) return image.local;
  local_extractor_->extract(image.grey, image.local);
  dropMasked(config_.mask, image.local);
  image.has_local = true;
  return image.local;
}

bool FrontEnd::previousIsClose() const {
  if (!previous_) return false;
  const double gap_s = secondsBetween(previous_->stamp_ns, current_->stamp_ns);
  return gap_s > 0.0 && gap_s <= config_.max_image_gap_s;
}

}  // namespace visual_localization

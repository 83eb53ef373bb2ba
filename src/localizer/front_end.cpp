#include "visual_localization/localizer/front_end.h"

#include <utility>

#include <opencv2/imgproc.hpp>

#include "visual_localization/features/contrast.h"
#include "visual_localization/features/pruning.h"
#include "visual_localization/geo/geodetic_point.h"
#include "visual_localization/localizer/stopwatch.h"

namespace visual_localization {

FrontEnd::FrontEnd(const SiftConfig& sift, const MatchConfig& match, cv::Size image_size, bool prune,
                   double max_image_gap_s, const std::string& sift_backend)
    : match_(match),
      image_size_(image_size),
      prune_(prune),
      max_image_gap_s_(max_image_gap_s),
      sift_extractor_(makeSiftExtractor(sift, sift_backend)) {}

void FrontEnd::configure(const MatchConfig& match, bool prune, double max_image_gap_s) {
  match_ = match;
  prune_ = prune;
  max_image_gap_s_ = max_image_gap_s;
  has_pruned_ = false;
}

void FrontEnd::setImage(std::int64_t stamp_ns, const cv::Mat& grey) {
  const Stopwatch stopwatch;
  requireExtractable(grey);
  const cv::Mat& fitting = fitted(grey);
  const GreyLevels levels = greyLevelsOf(fitting);
  const cv::Mat& image = withUsualContrast(fitting, levels, spread_);
  is_repeated_ = current_ && areIdentical(image, current_->grey);
  if (!is_repeated_) takeImage(image);
  current_->stamp_ns = stamp_ns;
  look_ = {levels.mean, levels.contrast,
           static_cast<double>(grey.cols) * image_size_.height / (static_cast<double>(grey.rows) * image_size_.width)};
  extract_ms_ = stopwatch.elapsed_ms();
}

const cv::Mat& FrontEnd::fitted(const cv::Mat& grey) {
  if (grey.size() == image_size_) return grey;
  cv::resize(grey, resized_, image_size_, 0.0, 0.0, cv::INTER_AREA);
  return resized_;
}

void FrontEnd::takeImage(const cv::Mat& image) {
  std::swap(previous_, current_);
  if (!current_) current_ = Image{};
  image.copyTo(current_->grey);
  current_->has_sift = false;
  has_pruned_ = false;
  global_.reset();
}

const SiftFeatures& FrontEnd::sift() {
  if (has_pruned_) return pruned_;
  const Stopwatch stopwatch;
  const SiftFeatures& all = unprunedSift(*current_);
  constexpr std::size_t kLeast = 2;  // an image without features confirms nothing
  const bool prunable = prune_ && previousIsClose() && unprunedSift(*previous_).size() >= kLeast;
  if (prunable) {
    keepSeenIn(all, previous_->sift, match_.max_angle_ratio, pruned_);
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
  global_ = global_extractor_.extract(current_->grey);
  extract_ms_ += stopwatch.elapsed_ms();
  return *global_;
}

const SiftFeatures& FrontEnd::unprunedSift(Image& image) {
  if (!image.has_sift) sift_extractor_->extract(image.grey, image.sift);
  image.has_sift = true;
  return image.sift;
}

bool FrontEnd::previousIsClose() const {
  if (!previous_) return false;
  const double gap_s = secondsBetween(previous_->stamp_ns, current_->stamp_ns);
  return gap_s > 0.0 && gap_s <= max_image_gap_s_;
}

}  // namespace visual_localization

#include "visual_localization/features/native_sift_extractor.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <tuple>

#include "visual_localization/features/sift_refinement.h"

namespace visual_localization {
namespace {

/// Pixels of the image to a pixel of the octave: the first one is doubled.
float pixelsOf(int octave) { return std::ldexp(0.5F, octave); }

SiftKeypoint keypointOf(const SiftPoint& point) {
  const float px = pixelsOf(point.octave);
  return {point.x_px * px, point.y_px * px, 2.0F * point.sigma_px * px, point.angle_deg};
}

/// What makes two points the same feature; larger ones first where several are at the same place.
auto identity(const SiftPoint& point) {
  const SiftKeypoint keypoint = keypointOf(point);
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

NativeSiftExtractor::NativeSiftExtractor(const SiftConfig& config)
    : config_(config), scale_space_(config), search_(config) {}

void NativeSiftExtractor::extract(const cv::Mat& grey, SiftFeatures& features) {
  requireExtractable(grey);
  scale_space_.setImage(grey);
  detect();
  keypoints_.clear();
  descriptors_.resize(points_.size() * SiftFeatures::kDescriptorSize);
  std::uint8_t* descriptor = descriptors_.data();
  for (const SiftPoint& point : points_) {
    keypoints_.push_back(keypointOf(point));
    const SiftOctave& octave = scale_space_.octave(static_cast<std::size_t>(point.octave));
    describer_.describe(octave.levels[static_cast<std::size_t>(point.level)], point, descriptor);
    descriptor += SiftFeatures::kDescriptorSize;
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
    if (point) orientations_.assign(octave.levels[static_cast<std::size_t>(point->level)], *point, points_);
  }
}

/// As in OpenCV, all features that are as strong as the weakest one kept are kept too.
void NativeSiftExtractor::keepStrongest() {
  const auto most = static_cast<std::size_t>(config_.max_features);
  if (most == 0 || points_.size() <= most) return;
  responses_.clear();
  for (const SiftPoint& point : points_) responses_.push_back(point.response);
  const auto weakest = responses_.begin() + static_cast<std::ptrdiff_t>(most - 1);
  std::nth_element(responses_.begin(), weakest, responses_.end(), std::greater<>());
  const float least = *weakest;
  const auto is_weak = [least](const SiftPoint& point) { return point.response < least; };
  points_.erase(std::remove_if(points_.begin(), points_.end(), is_weak), points_.end());
}

}  // namespace visual_localization

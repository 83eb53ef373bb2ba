#include "visual_localization/localizer/front_end.h"

#include <stdexcept>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "visual_localization/features/pruning.h"
#include "visual_localization/geo/geodetic_point.h"

namespace visual_localization {

FrontEnd::FrontEnd(const SiftConfig& sift, const MatchConfig& match, cv::Size image_size, bool prune,
                   double max_image_gap_s)
    : match_(match),
      image_size_(image_size),
      prune_(prune),
      max_image_gap_s_(max_image_gap_s),
      extractor_(makeSiftExtractor(sift)) {}

Observation FrontEnd::observe(std::int64_t stamp_ns, const cv::Mat& grey) {
  requireExtractable(grey);
  cv::Mat resized = grey;
  if (grey.size() != image_size_) cv::resize(grey, resized, image_size_, 0.0, 0.0, cv::INTER_AREA);

  SiftFeatures sift = extractor_->extract(resized);
  Observation observation;
  observation.stamp_ns = stamp_ns;
  observation.features_extracted = sift.size();
  observation.features.sift =
      prune_ && follows(stamp_ns) ? keepSeenIn(sift, {&previous_->sift}, match_.max_angle_ratio) : sift;
  previous_ = Previous{stamp_ns, std::move(sift)};
  return observation;
}

bool FrontEnd::follows(std::int64_t stamp_ns) const {
  constexpr std::size_t kLeast = 2;  // an image without features confirms nothing
  if (!previous_ || previous_->sift.size() < kLeast) return false;
  const double gap_s = secondsBetween(previous_->stamp_ns, stamp_ns);
  return gap_s > 0.0 && gap_s <= max_image_gap_s_;
}

}  // namespace visual_localization

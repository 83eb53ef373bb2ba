#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include <opencv2/core.hpp>

#include "visual_localization/features/image_features.h"
#include "visual_localization/features/sift_extractor.h"
#include "visual_localization/features/sift_matcher.h"

namespace visual_localization {

/// The features of one live image, before and after pruning.
struct Observation {
  std::int64_t stamp_ns = 0;
  ImageFeatures features;              ///< after pruning
  std::size_t features_extracted = 0;  ///< before
};

/// Live image in, features out: resizes to the map's size, extracts, and keeps what the image directly before
/// showed as well (Weiss et al., section III). The first image, or one after a gap or after an image
/// without features, is not pruned.
class FrontEnd {
 public:
  FrontEnd(const SiftConfig& sift, const MatchConfig& match, cv::Size image_size, bool prune, double max_image_gap_s);

  /// `grey`: 8-bit, one channel, any size of at least 16 x 16; throws std::invalid_argument otherwise.
  Observation observe(std::int64_t stamp_ns, const cv::Mat& grey);

 private:
  struct Previous {
    std::int64_t stamp_ns = 0;
    SiftFeatures sift;
  };

  bool follows(std::int64_t stamp_ns) const;

  MatchConfig match_;
  cv::Size image_size_;
  bool prune_;
  double max_image_gap_s_;
  std::unique_ptr<SiftExtractor> extractor_;
  std::optional<Previous> previous_;
};

}  // namespace visual_localization

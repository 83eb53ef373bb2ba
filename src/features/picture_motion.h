#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "geo/clock_offset.h"
#include "visual_localization/features/local_features.h"

namespace visual_localization {

/// Measures in small copies of a drive's images how far the picture moves from one to the next: the displacement that
/// most of their matched features share.
class PictureMotion {
 public:
  explicit PictureMotion(std::size_t threads);
  ~PictureMotion();

  /// Whether an image of this time would tell something new; give only these to add().
  bool wants(std::int64_t stamp_ns) const;
  /// `grey`: 8-bit, one channel; too small ones count for nothing.
  void add(std::int64_t stamp_ns, const cv::Mat& grey);
  /// Of all images so far, in order of time. Ends it.
  std::vector<PictureShift> finish();

 private:
  struct Waiting;
  void extractWaiting();

  std::size_t threads_;
  std::vector<std::unique_ptr<LocalExtractor>> extractors_;
  std::vector<Waiting> waiting_;
  std::optional<std::int64_t> last_ns_;
  std::int64_t before_ns_ = 0;
  std::optional<LocalFeatures> before_;
  std::vector<PictureShift> shifts_;
};

}  // namespace visual_localization

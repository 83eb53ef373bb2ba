#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <vector>

#include <opencv2/core.hpp>
#include <visual_localization/LocalizationStatus.h>

#include "visual_localization/features/feature_matcher.h"
#include "visual_localization/features/local_features.h"
#include "visual_localization/localization/estimate.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// The current image (left) beside training image `training` (right), with a line for each match, by the rule that the
/// localizer compares them by. `grey`: 8-bit, one channel, any size; `sift`: its features in pixels of the map's image
/// size. The map keeps only a small preview of a training image, which is enlarged; without one the right half stays
/// dark. Returns an 8-bit BGR image.
cv::Mat drawMatches(const cv::Mat& grey, const LocalFeatures& sift, const TrainingMap& map, std::size_t training,
                    const MatchConfig& match);

/// Beside the training image that shares most landmarks: green those that agree with the pose, red those that do not.
cv::Mat drawLandmarks(const cv::Mat& grey, const MatchedLandmarks& matched, const TrainingMap& map);

/// A picture that is out of date: dark and without colour, with the reason across it.
cv::Mat greyedOut(const cv::Mat& canvas, const std::string& reason);

/// The status as a picture for people: the state in colour and why it holds, the figures that explain it, and their
/// history over the last images. Thread-safe.
class Dashboard {
 public:
  static constexpr std::size_t kShown = 120;

  void add(const LocalizationStatus& status);
  /// 8-bit BGR, always of the same size.
  cv::Mat draw() const;

 private:
  mutable std::mutex mutex_;
  std::deque<LocalizationStatus> statuses_;  ///< newest at the back
};

/// Lines of at most `most` bytes, broken at spaces; a longer word is broken too.
std::vector<std::string> inLines(std::string text, std::size_t most);

/// BGR; the same in the plots of scripts/.
cv::Scalar colourOfState(std::uint8_t state);

}  // namespace visual_localization

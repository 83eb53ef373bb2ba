#pragma once

#include <cstddef>
#include <deque>
#include <mutex>

#include <opencv2/core.hpp>
#include <visual_localization/LocalizationStatus.h>

namespace visual_localization {

/// The status as a picture for people: the state in colour, the figures that explain it, and their history over the
/// last images. Thread-safe.
class Dashboard {
 public:
  static constexpr std::size_t kShown = 120;  ///< number of images that are remembered

  void add(const LocalizationStatus& status);
  /// 8-bit BGR, always of the same size; dark when nothing has been added.
  cv::Mat draw() const;

 private:
  mutable std::mutex mutex_;
  std::deque<LocalizationStatus> statuses_;  ///< newest at the back
};

/// BGR; the same in the plots of scripts/.
cv::Scalar colourOfState(std::uint8_t state);

}  // namespace visual_localization

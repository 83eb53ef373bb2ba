#pragma once

#include <cstddef>

#include "evaluation/run.h"

namespace visual_localization {

/// How far a tracker's states can be trusted: counts of judged images. "Lost" is every state but TRACKING, and truly
/// lost an estimate that is not right (kRight_m).
struct Trust {
  std::size_t tracking_right = 0;  ///< TRACKING, and right
  std::size_t tracking_wrong = 0;  ///< TRACKING, but not right
  std::size_t lost_right = 0;      ///< called lost, and truly lost
  std::size_t lost_wrong = 0;      ///< called lost, but right
  std::size_t off_map_right = 0;   ///< OFF_MAP, and farther than kOffMap_m from all of the map
  std::size_t off_map_wrong = 0;   ///< OFF_MAP, but not that far
  std::size_t off_map_missed = 0;  ///< that far, and another state

  /// Images without a true position and methods without states are left out.
  void add(const StepRecord& step);
  Trust& operator+=(const Trust& other);

  // NaN when there is nothing to divide by.
  double trackingShare() const;  ///< of all images
  double wrongTracking() const;  ///< share of the TRACKING claims that are wrong
  double lostPrecision() const;  ///< share of the images called lost that truly are
  double lostRecall() const;     ///< share of the truly lost images that are called so
  double offMapPrecision() const;
  double offMapRecall() const;
};

}  // namespace visual_localization

#pragma once

#include <cstddef>
#include <vector>

#include "evaluation/run.h"

namespace visual_localization {

/// Summary of localisation errors: distances between estimated and true positions, metres.
struct ErrorStatistics {
  std::size_t count = 0;
  double mean_m = 0.0;
  double median_m = 0.0;
  double within_5m = 0.0;  ///< share of errors below kRight_m, 5 m
};

/// All fields zero when there is no error to summarise.
ErrorStatistics summarise(std::vector<double> errors_m);

/// One answer of a place recogniser and whether it was right.
struct Decision {
  double confidence = 0.0;
  bool correct = false;
};

/// The largest share of all decisions, in [0, 1], that are accepted and correct when only those above some threshold of
/// confidence are accepted and at least the share `precision` of these is correct. Equal confidences are accepted
/// together. 0 when no threshold is good enough. Throws std::invalid_argument for a `precision` outside [0, 1] and for
/// a confidence that is NaN.
double recallAtPrecision(std::vector<Decision> decisions, double precision);

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

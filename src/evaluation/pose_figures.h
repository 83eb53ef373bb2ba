#pragma once

#include <array>
#include <cstddef>

#include "evaluation/run.h"

namespace visual_localization {

/// An error within both is a success of the long-term localisation benchmark (Sattler et al., 2018).
struct RecallThreshold {
  double position_m;
  double heading_deg;
};
constexpr std::array<RecallThreshold, 3> kRecall{{{0.25, 2.0}, {0.5, 5.0}, {5.0, 10.0}}};

/// Errors of poses against one truth: the true poses themselves, or these moved by the map's own error.
struct PoseErrors {
  std::size_t positions = 0;  ///< images whose error is known
  double position_m = 0.0;    ///< sum
  std::size_t headings = 0;   ///< images whose error of heading is known as well
  double heading_deg = 0.0;   ///< sum
  std::array<std::size_t, kRecall.size()> recalled{};
  std::size_t claims = 0;     ///< images that say how accurate they are
  std::size_t inside_95 = 0;  ///< of these, with the truth inside the 95 % ellipse
  double nees = 0.0;          ///< sum of the squared errors in units of their covariance, two degrees of freedom

  void add(const StepErrors& errors);
  PoseErrors& operator+=(const PoseErrors& other);

  // NaN when there is nothing to divide by.
  double meanPosition_m() const;
  double meanHeading_deg() const;
  double recall(std::size_t threshold) const;
  double insideShare() const;
  double meanNees() const;
};

/// What the poses of a method come to over judged images.
struct PoseFigures {
  std::size_t images = 0;    ///< judged, of a method with states
  std::size_t metric = 0;    ///< solved from landmarks
  std::size_t wrong_1m = 0;  ///< TRACKING, and farther from the truth
  std::size_t wrong_5m = 0;
  PoseErrors absolute;
  PoseErrors relative;  ///< to the map
  PoseErrors filtered;  ///< see StepRecord
  PoseErrors relative_filtered;

  /// Images without a true position are left out.
  void add(const StepRecord& step);
  PoseFigures& operator+=(const PoseFigures& other);

  // NaN when there is nothing to divide by.
  double metricShare() const;
  double wrong1mShare() const;
  double wrong5mShare() const;
};

}  // namespace visual_localization

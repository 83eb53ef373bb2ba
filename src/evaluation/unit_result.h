#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "evaluation/metrics.h"
#include "evaluation/run.h"

namespace visual_localization {

/// What extraction and comparisons cost in one pair of rounds, milliseconds of processor time each.
struct StageCosts {
  double sift_extraction_ms = 0.0;
  double global_extraction_ms = 0.0;
  double sift_comparison_ms = 0.0;
  double global_comparison_ms = 0.0;
};

/// The figures of one run.
struct RunFigures {
  std::size_t start = 0;
  std::size_t images = 0;
  std::size_t judged = 0;  ///< images with a true position
  double mean_err_m = 0.0;
  double within_5m = 0.0;  ///< share of the judged
  double comparisons_per_image = 0.0;
  double sift_share = 0.0;  ///< share of the images that were compared by SIFT
  std::size_t steps_to_localise = 0;
  std::size_t steps_to_relocalise = 0;  ///< meaningless unless kidnapped
  double extract_ms = 0.0;              ///< per image, as are the others
  double match_ms = 0.0;
  double update_ms = 0.0;
};

/// Sums over all runs at the same number of images since the start.
struct StepSums {
  std::size_t runs = 0;
  std::size_t judged = 0;
  double err_m = 0.0;
  std::size_t comparisons = 0;
  std::size_t sift = 0;
};

/// One image of the traced run of a tracker, as lines of TUM trajectories.
struct TracedPose {
  std::string estimate;
  std::string truth;  ///< empty when it is not known
};

/// Goes up whenever older results cannot be read any more.
constexpr int kUnitFormat = 4;

/// One method on one pair of rounds: the unit of work that is stored and resumed.
struct UnitResult {
  std::vector<RunFigures> runs;
  std::vector<StepSums> steps;
  Trust trust;
  Claims claims;
  PoseFigures poses;
  std::vector<std::string> trace;      ///< rows of traces.csv from its column `start` on
  std::vector<TracedPose> trajectory;  ///< of the same images
  double median_err_m = 0.0;           ///< over all images of all runs
  double recall_at_p99 = 0.0;          ///< share of the images answered rightly when 99 % of the answers are right
  double p95_err_m = 0.0;              ///< 95 % of the images are not farther from the truth
  double p95_relative_err_m = 0.0;     ///< the same in relation to the map; 0 when nothing is known of that
};

UnitResult summariseRuns(const std::vector<RunRecord>& runs, const StageCosts& costs);

/// parseUnit throws std::runtime_error when the text is not whole.
std::string serialise(const UnitResult& unit);
UnitResult parseUnit(const std::string& text);

extern const char* const kTraceColumns;

}  // namespace visual_localization

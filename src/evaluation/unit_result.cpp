#include "evaluation/unit_result.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <utility>

#include "base/statistics.h"
#include "base/text.h"
#include "evaluation/metrics.h"
#include "evaluation/pose_judge.h"

namespace visual_localization {
namespace {

constexpr double kPrecision = 0.99;
constexpr double kMost = 0.95;

std::ostringstream numbers() { return numberStream(std::numeric_limits<double>::digits10); }

RunFigures figuresOf(const RunRecord& run, const StageCosts& costs) {
  RunFigures figures;
  figures.start = run.start;
  figures.images = run.steps.size();
  figures.steps_to_localise = run.steps_to_localise;
  figures.steps_to_relocalise = run.steps_to_relocalise;
  for (const StepRecord& step : run.steps) {
    figures.comparisons_per_image += step.comparisons;
    figures.sift_share += step.sift ? 1.0 : 0.0;
    if (std::isnan(step.error_m)) continue;
    ++figures.judged;
    figures.mean_err_m += static_cast<double>(step.error_m);
    figures.within_5m += static_cast<double>(step.error_m) < kRight_m ? 1.0 : 0.0;
  }
  const auto images = static_cast<double>(figures.images);
  const auto judged = static_cast<double>(std::max<std::size_t>(1, figures.judged));
  figures.mean_err_m /= judged;
  figures.within_5m /= judged;
  figures.comparisons_per_image /= images;
  figures.sift_share /= images;
  figures.extract_ms = (static_cast<double>(run.sift_extractions) * costs.sift_extraction_ms +
                        static_cast<double>(run.global_extractions) * costs.global_extraction_ms) /
                       images;
  figures.match_ms = (static_cast<double>(run.sift_comparisons) * costs.sift_comparison_ms +
                      static_cast<double>(run.global_comparisons) * costs.global_comparison_ms) /
                     images;
  figures.update_ms = run.method_ms / images;
  return figures;
}

void add(const StepRecord& step, StepSums& sums) {
  ++sums.runs;
  sums.comparisons += step.comparisons;
  sums.sift += step.sift ? 1 : 0;
  if (std::isnan(step.error_m)) return;
  ++sums.judged;
  sums.err_m += static_cast<double>(step.error_m);
}

TracedPose tracedPose(const TraceRecord& trace) {
  TracedPose pose{tumLine(trace.estimate), ""};
  if (trace.truth_m) pose.truth = tumLine(trace.estimate.stamp_ns, *trace.truth_m, trace.true_yaw_rad.value_or(0.0));
  return pose;
}

/// 0 of none.
double mostOf(std::vector<double> errors_m) {
  if (errors_m.empty()) return 0.0;
  std::sort(errors_m.begin(), errors_m.end());
  return quantile(errors_m, kMost);
}

std::string traceRow(const RunRecord& run, std::size_t step) {
  const TraceRecord& trace = run.trace[step];
  const Estimate& estimate = trace.estimate;
  const TrackerTuning& tuning = estimate.tracked.tuning;
  std::ostringstream out = numbers();
  out << run.start << ',' << step << ',' << trace.image << ',';
  if (!std::isnan(run.steps[step].error_m)) out << run.steps[step].error_m;
  if (tuning.v0 > 0.0) {
    out << ',' << tuning.v0 << ',' << tuning.speed_ema << ',' << tuning.quantum_share << ',' << tuning.phi2;
  } else {
    out << ",,,,";  // a particle filter has nothing to tune
  }
  out << ',' << (tuning.recovering ? 1 : 0) << ',' << estimate.tracked.spread_m.x() << ','
      << estimate.tracked.spread_m.y() << ',' << trace.diversity_m << ',' << estimate.tracked.best.similarity << ','
      << estimate.comparisons << ',' << toString(estimate.evidence.features);
  return out.str();
}

}  // namespace

const char* const kTraceColumns =
    "start,step,image,err_m,v0,speed_ema,quantum_share,phi2,recovering,spread_x_m,spread_y_m,diversity_m,similarity,"
    "comparisons,features";

UnitResult summariseRuns(const std::vector<RunRecord>& runs, const StageCosts& costs) {
  UnitResult unit;
  std::vector<double> errors_m;
  std::vector<double> relative_m;
  std::vector<Decision> decisions;
  for (const RunRecord& run : runs) {
    unit.runs.push_back(figuresOf(run, costs));
    if (unit.steps.size() < run.steps.size()) unit.steps.resize(run.steps.size());
    for (std::size_t i = 0; i < run.steps.size(); ++i) {
      const StepRecord& step = run.steps[i];
      add(step, unit.steps[i]);
      unit.trust.add(step);
      unit.poses.add(step);
      if (!std::isnan(step.relative.position_m)) relative_m.push_back(static_cast<double>(step.relative.position_m));
      if (std::isnan(step.error_m)) continue;
      errors_m.push_back(static_cast<double>(step.error_m));
      decisions.push_back({static_cast<double>(step.confidence), errors_m.back() < kRight_m});
    }
    for (std::size_t i = 0; i < run.trace.size(); ++i) {
      unit.trace.push_back(traceRow(run, i));
      unit.trajectory.push_back(tracedPose(run.trace[i]));
    }
  }
  unit.p95_err_m = mostOf(errors_m);
  unit.p95_relative_err_m = mostOf(std::move(relative_m));
  unit.median_err_m = summarise(std::move(errors_m)).median_m;
  unit.recall_at_p99 = recallAtPrecision(std::move(decisions), kPrecision);
  return unit;
}

}  // namespace visual_localization

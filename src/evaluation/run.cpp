#include "visual_localization/evaluation/run.h"

#include "visual_localization/evaluation/cpu_stopwatch.h"
#include "visual_localization/evaluation/image_order.h"

namespace visual_localization {
namespace {

/// Images from step `begin` on until the first of three right estimates in a row; all of them when that never comes.
std::size_t stepsUntilRight(const std::vector<StepRecord>& steps, std::size_t begin, std::size_t end) {
  constexpr std::size_t kInARow = 3;
  std::size_t right = 0;
  for (std::size_t i = begin; i < end; ++i) {
    right = steps[i].error_m < kRight_m ? right + 1 : 0;
    if (right == kInARow) return i + 2 - kInARow - begin;
  }
  return end - begin;
}

/// Counts the extractions that a live front end would have made.
class ExtractionCounter {
 public:
  void add(const RecordedImage& image, RunRecord& record) {
    const bool sift = image.siftComparisons() > 0;
    // Pruning needs the SIFT features of the image before; a hybrid that comes from global features has none yet.
    if (sift) record.sift_extractions += first_ || previous_had_sift_ ? 1 : 2;
    if (image.globalComparisons() > 0) ++record.global_extractions;
    record.sift_comparisons += image.siftComparisons();
    record.global_comparisons += image.globalComparisons();
    previous_had_sift_ = sift;
    first_ = false;
  }

 private:
  bool first_ = true;
  bool previous_had_sift_ = false;
};

/// Compares the verdict with the truth, if that is known.
void judge(const DriveImage& image, const TrainingMap& map, const Verdict& verdict, StepRecord& step) {
  if (!image.truth) return;
  const Eigen::Vector2d truth_m = map.frame().toEastNorth(*image.truth);
  step.error_m = static_cast<float>((verdict.position_m - truth_m).norm());
  step.off_map = map.nearest(truth_m).distance_m > kOffMap_m;
}

/// Different for every run, the same whenever it is repeated; a seed of the localizer, which is not negative.
std::uint32_t seedOf(const MethodSpec& method, std::size_t start) {
  constexpr std::uint32_t kLargest = 0x7FFFFFFF;
  return (static_cast<std::uint32_t>(method.localizer.seed) + static_cast<std::uint32_t>(start)) & kLargest;
}

}  // namespace

RunRecord run(const RunContext& context, const MethodSpec& method, std::size_t start, bool trace) {
  const SiftSimilarity sift(method.localizer.match, method.localizer.similarity);
  const GlobalSimilarity global(method.localizer.similarity);
  const auto contestant = makeContestant(method, context.map.map, seedOf(method, start), context.closed);
  const std::vector<std::size_t> order =
      imageOrder(context.drive.images.size(), start, RunShape{context.closed, method.speed, method.kidnapped});
  RunRecord record;
  record.start = start;
  ExtractionCounter counter;
  const auto covered_from = order.size() / 2;
  const auto covered_until =
      covered_from + static_cast<std::size_t>(method.covered * static_cast<double>(order.size()));
  for (std::size_t i = 0; i < order.size(); ++i) {
    const DriveImage& shown = context.drive.images[order[i]];
    RecordedImage image(context.table, order[i], sift, global);
    image.restrictTo(context.map.images);
    if (i >= covered_from && i < covered_until) image.cover();
    const CpuStopwatch stopwatch;
    const Verdict verdict = contestant->process(shown.stamp_ns, image);
    record.method_ms += stopwatch.elapsed_ms();
    counter.add(image, record);
    StepRecord step;
    step.confidence = static_cast<float>(verdict.confidence);
    step.comparisons = static_cast<std::uint32_t>(verdict.comparisons);
    step.sift = verdict.features == FeatureKind::kSift;
    if (verdict.estimate) step.state = verdict.estimate->state;
    judge(shown, *context.map.map, verdict, step);
    record.steps.push_back(step);
    if (trace && verdict.estimate) record.trace.push_back({order[i], contestant->diversity_m(), *verdict.estimate});
  }
  const std::size_t half = method.kidnapped ? order.size() / 2 : order.size();
  record.steps_to_localise = stepsUntilRight(record.steps, 0, half);
  record.steps_to_relocalise = stepsUntilRight(record.steps, half, order.size());
  return record;
}

}  // namespace visual_localization

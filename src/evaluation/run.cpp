#include "evaluation/run.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "base/numbers.h"
#include "base/time.h"
#include "evaluation/metrics.h"
#include "visual_localization/localization/localizer.h"

namespace visual_localization {
namespace {

/// What a method under test says after one image.
struct Verdict {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< in the map frame
  double confidence = 0.0;                               ///< the larger the surer
  FeatureKind features = FeatureKind::kLocal;
  std::size_t comparisons = 0;       ///< training images compared
  std::optional<Estimate> estimate;  ///< of a tracker, for tracing
};

/// A method under test in one run.
class TestedMethod {
 public:
  virtual ~TestedMethod() = default;
  virtual Verdict process(std::int64_t stamp_ns) = 0;
  /// Mean distance between two particles, metres; 0 without particles. Not cheap.
  virtual double diversity_m() const { return 0.0; }
};

LocalizerConfig seeded(LocalizerConfig config, std::uint32_t seed) {
  config.seed = static_cast<int>(seed);
  return config;
}

/// A tracker, run by the localizer that runs on the robot.
class TestedTracker final : public TestedMethod {
 public:
  /// `camera`: of the drive; none: that of the map.
  TestedTracker(std::shared_ptr<const TrainingMap> map, const LocalizerConfig& config,
                std::shared_ptr<RecordedImage> image, const std::optional<CameraModel>& camera)
      : similarity_(config.similarity), match_(config.match), localizer_(std::move(map), config, std::move(image)) {
    if (camera) localizer_.setCamera(*camera);
  }

  Verdict process(std::int64_t stamp_ns) override {
    const Estimate estimate = localizer_.process(stamp_ns, cv::Mat());
    confidence_ += kNewest * (evidenceOf(estimate) - confidence_);
    return {estimate.pose.position_m, confidence_, estimate.evidence.features, estimate.comparisons, estimate};
  }

  double diversity_m() const override {
    const std::vector<Particle>& particles = localizer_.particles();
    double sum_m = 0.0;
    for (std::size_t i = 0; i < particles.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) sum_m += (particles[i].position_m - particles[j].position_m).norm();
    }
    const auto count = static_cast<double>(particles.size());
    return count < 2.0 ? 0.0 : 2.0 * sum_m / (count * (count - 1.0));
  }

 private:
  /// Of the newest image: about five images count, as for the state.
  static constexpr double kNewest = 1.0 / 3.0;

  /// In units of what counts as recognised, so that both kinds of features compare; none when the match is not where
  /// the estimate is.
  double evidenceOf(const Estimate& estimate) const {
    const TrackerEstimate& tracked = estimate.tracked;
    if (tracked.best_distance_m > kRight_m) return 0.0;
    const double recognised = similarity_.recognised(estimate.evidence.features, match_);
    return recognised > 0.0 ? tracked.best.similarity / recognised : tracked.best.similarity;
  }

  SimilarityConfig similarity_;
  MatchConfig match_;
  Localizer localizer_;
  double confidence_ = 0.0;
};

class TestedRecogniser final : public TestedMethod {
 public:
  TestedRecogniser(std::shared_ptr<const TrainingMap> map, const MethodSpec& method, bool closed,
                   std::shared_ptr<RecordedImage> image)
      : map_(std::move(map)),
        image_(std::move(image)),
        features_(method.localizer.features == "global" ? FeatureKind::kGlobal : FeatureKind::kLocal),
        recogniser_(makePlaceRecogniser(method.tracker, method.recogniser, closed)) {}

  Verdict process(std::int64_t) override {
    image_->row(features_, row_);
    const Recognition recognition = recogniser_->update(row_);
    return {map_->position_m(recognition.training_image), recognition.confidence, features_, row_.size(), {}};
  }

 private:
  std::shared_ptr<const TrainingMap> map_;
  std::shared_ptr<RecordedImage> image_;
  FeatureKind features_;
  std::unique_ptr<PlaceRecogniser> recogniser_;
  std::vector<double> row_;
};

/// From step `begin` on, until the first of three estimates in a row that are right; all when never.
std::size_t stepsUntilFound(const std::vector<StepRecord>& steps, double within_m, std::size_t begin, std::size_t end) {
  constexpr std::size_t kInARow = 3;
  std::size_t right = 0;
  for (std::size_t i = begin; i < end; ++i) {
    right = static_cast<double>(steps[i].error_m) < within_m ? right + 1 : 0;
    if (right == kInARow) return i + 2 - kInARow - begin;
  }
  return end - begin;
}

/// Counts the extractions that a live front end would have made.
class ExtractionCounter {
 public:
  void add(const RecordedImage& image, RunRecord& record) {
    const bool compared = image.siftComparisons() > 0;
    // A hybrid that comes from global features has no SIFT features of the image before yet.
    if (compared) {
      record.sift_extractions += first_ || previous_had_sift_ ? 1 : 2;
    } else if (image.poseWasAsked()) {
      ++record.sift_extractions;  // not pruned
    }
    if (image.globalComparisons() > 0) ++record.global_extractions;
    record.sift_comparisons += image.siftComparisons();
    record.global_comparisons += image.globalComparisons();
    previous_had_sift_ = compared || image.poseWasAsked();
    first_ = false;
  }

 private:
  bool first_ = true;
  bool previous_had_sift_ = false;
};

void judge(const DriveImage& image, const TrainingMap& map, const Accuracy& accuracy,
           const std::optional<MapError>& map_error, const Verdict& verdict, VelocityFilter& filter, StepRecord& step) {
  if (!image.truth) return;
  const Eigen::Vector2d truth_m = map.frame().toEastNorth(image.truth->position);
  step.error_m = static_cast<float>((verdict.position_m - truth_m).norm());
  step.right = static_cast<double>(step.error_m) <= accuracy.right_m;
  step.wrong = !(static_cast<double>(step.error_m) <= accuracy.wrong_m);
  step.off_map = map.nearest(truth_m).distance_m > kOffMap_m;
  if (map_error) {
    step.relative.position_m = static_cast<float>((verdict.position_m - truth_m - map_error->position_m).norm());
  }
  if (!verdict.estimate) return;
  judgePose(*verdict.estimate, truth_m, image.truth->yaw_rad, map_error, step);
  judgeFiltered(*verdict.estimate, truth_m, map_error, filter, step);
}

/// As if its true position were not known.
void leaveUnjudged(StepRecord& step) {
  const StepRecord unknown;
  step.error_m = unknown.error_m;
  step.heading_err_deg = unknown.heading_err_deg;
  step.nees = unknown.nees;
  step.relative = step.filtered = step.relative_filtered = StepErrors();
}

StepRecord stepOf(const Verdict& verdict) {
  StepRecord step;
  step.confidence = static_cast<float>(verdict.confidence);
  step.comparisons = static_cast<std::uint32_t>(verdict.comparisons);
  step.sift = verdict.features == FeatureKind::kLocal;
  if (!verdict.estimate) return step;
  step.state = verdict.estimate->state;
  step.source = verdict.estimate->source;
  const std::optional<double>& probability = verdict.estimate->evidence.probability;
  if (probability) step.probability = static_cast<float>(*probability);
  return step;
}

TraceRecord traced(std::size_t index, const DriveImage& image, const TrainingMap& map, double diversity_m,
                   const Estimate& estimate) {
  TraceRecord trace{index, diversity_m, estimate};
  if (!image.truth) return trace;
  trace.truth_m = map.frame().toEastNorth(image.truth->position);
  trace.true_yaw_rad = image.truth->yaw_rad;
  return trace;
}

/// Different for every run, the same when repeated; not negative.
std::uint32_t seedOf(const MethodSpec& method, std::size_t start, std::size_t repetition) {
  constexpr std::uint32_t kLargest = 0x7FFFFFFF;
  constexpr std::size_t kPrime = 1000003;  // more than a drive has images
  return (static_cast<std::uint32_t>(method.localizer.seed) + static_cast<std::uint32_t>(start + kPrime * repetition)) &
         kLargest;
}

std::unique_ptr<TestedMethod> makeTestedMethod(const MethodSpec& method, std::uint32_t seed, const RunContext& context,
                                               std::shared_ptr<RecordedImage> image) {
  if (!method.isTracker()) {
    return std::make_unique<TestedRecogniser>(context.map.map, method, context.closed, std::move(image));
  }
  return std::make_unique<TestedTracker>(context.map.map, seeded(method.localizer, seed), std::move(image),
                                         context.drive.camera);
}

}  // namespace

RunRecord run(const RunContext& context, const MethodSpec& method, std::size_t start, bool trace,
              std::size_t repetition) {
  const auto image = std::make_shared<RecordedImage>(context.table, context.map.images, method.localizer.match,
                                                     method.localizer.similarity);
  const auto tested = makeTestedMethod(method, seedOf(method, start, repetition), context, image);
  const std::vector<std::size_t> order = imageOrder(
      context.drive.images.size(), start, RunShape{context.closed, method.speed, method.kidnapped, context.longest});
  RunRecord record;
  record.start = start;
  ExtractionCounter counter;
  VelocityFilter filter;
  const auto covered_from = order.size() / 2;
  const auto covered_until =
      covered_from + static_cast<std::size_t>(method.covered * static_cast<double>(order.size()));
  for (std::size_t i = 0; i < order.size(); ++i) {
    const DriveImage& shown = context.drive.images[order[i]];
    image->show(order[i], i >= covered_from && i < covered_until, shown.unpruned ? &*shown.unpruned : nullptr);
    const CpuStopwatch stopwatch;
    const Verdict verdict = tested->process(shown.stamp_ns);
    record.method_ms += stopwatch.elapsed_ms();
    counter.add(*image, record);
    const TrainingMap& map = *context.map.map;
    record.steps.push_back(stepOf(verdict));
    judge(shown, map, context.accuracy, context.map_errors.empty() ? std::nullopt : context.map_errors[order[i]],
          verdict, filter, record.steps.back());
    if (trace && verdict.estimate) {
      record.trace.push_back(traced(order[i], shown, map, tested->diversity_m(), *verdict.estimate));
    }
  }
  const std::size_t half = method.kidnapped ? order.size() / 2 : order.size();
  record.steps_to_localise = stepsUntilFound(record.steps, context.found_within_m, 0, half);
  record.steps_to_relocalise = stepsUntilFound(record.steps, context.found_within_m, half, order.size());
  for (std::size_t i = 0; i < std::min(context.judge_from, order.size()); ++i) leaveUnjudged(record.steps[i]);
  return record;
}

}  // namespace visual_localization

#include "evaluation/run.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "base/numbers.h"
#include "base/time.h"
#include "evaluation/metrics.h"
#include "visual_localization/localization/localizer.h"

namespace visual_localization {
namespace {

void requireIndex(const std::string& name, std::size_t index, std::size_t images) {
  if (index < images) return;
  throw std::invalid_argument(name + " " + std::to_string(index) + " is not allowed: the drive has images 0 to " +
                              std::to_string(images - 1));
}

std::vector<std::size_t> outsideGap(std::size_t images, double gap) {
  constexpr double kBegin = 0.35;
  const auto shareOfMap = [images](double part) {
    return static_cast<std::size_t>(std::lround(part * static_cast<double>(images)));
  };
  const std::size_t begin = shareOfMap(kBegin);
  const std::size_t end = begin + (gap > 0.0 ? shareOfMap(gap) : 0);
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < images; ++i) {
    if (i < begin || i >= end) kept.push_back(i);
  }
  return kept;
}

std::vector<std::size_t> spaced(const TrainingMap& map, const std::vector<std::size_t>& images, double spacing_m) {
  std::vector<std::size_t> kept;
  for (const std::size_t i : images) {
    const bool follows = !kept.empty() && map.pose(kept.back()).session == map.pose(i).session;
    if (follows && (map.position_m(i) - map.position_m(kept.back())).norm() < spacing_m) continue;
    kept.push_back(i);
  }
  return kept;
}

}  // namespace

std::vector<std::size_t> imageOrder(std::size_t images, std::size_t start,
                                    const std::optional<Kidnapping>& kidnapping) {
  if (images == 0) return {};
  requireIndex("start index", start, images);
  if (kidnapping) {
    requireIndex("kidnapping at step", kidnapping->at, images);
    requireIndex("kidnapping to image", kidnapping->to, images);
  }
  std::vector<std::size_t> order(images);
  for (std::size_t step = 0; step < images; ++step) {
    const bool kidnapped = kidnapping && step >= kidnapping->at;
    order[step] = (kidnapped ? kidnapping->to + step - kidnapping->at : start + step) % images;
  }
  return order;
}

std::vector<std::size_t> imageOrder(std::size_t images, std::size_t start, const RunShape& shape) {
  if (images == 0) return {};
  requireIndex("start index", start, images);
  const std::size_t left = shape.closed ? images : images - start;
  const std::size_t ahead = shape.longest == 0 ? left : std::min(left, shape.longest);
  const auto travelledAt = [&shape](std::size_t step) {
    return static_cast<std::size_t>(std::floor(static_cast<double>(step) * shape.speed));
  };
  auto steps = static_cast<std::size_t>(std::ceil(static_cast<double>(ahead) / shape.speed));
  if (travelledAt(steps - 1) >= ahead) --steps;  // 21 / 0.7 is a little more than 30
  // Half a closed drive ahead is half of it back, and an open one has nothing ahead of its end.
  const std::size_t back = std::min(images / 2, start + travelledAt(steps / 2));
  const std::size_t carried = shape.closed ? images / 2 : images - back;
  std::vector<std::size_t> order(steps);
  for (std::size_t step = 0; step < steps; ++step) {
    const std::size_t jump = shape.kidnapped && step > 0 && step >= steps / 2 ? carried : 0;
    order[step] = (start + travelledAt(step) + jump) % images;
  }
  return order;
}

std::vector<std::size_t> startImages(std::size_t images, bool closed, std::size_t count) {
  const std::size_t possible = closed ? images : (images + 1) / 2;
  const std::size_t runs = count == 0 ? possible : std::min(count, possible);
  std::vector<std::size_t> starts(runs);
  for (std::size_t i = 0; i < runs; ++i) starts[i] = i * possible / runs;
  return starts;
}

std::vector<std::size_t> startImagesEvery(std::size_t images, bool closed, std::size_t every, std::size_t longest) {
  std::size_t possible = closed ? images : (images + 1) / 2;
  if (!closed && longest > 0 && images >= longest) possible = std::max(possible, images - longest + 1);
  std::vector<std::size_t> starts;
  for (std::size_t i = 0; i < possible; i += every) starts.push_back(i);
  return starts;
}

PartialMap partOf(std::shared_ptr<const TrainingMap> map, double gap, double spacing_m) {
  if (gap <= 0.0 && spacing_m <= 0.0) return {std::move(map), {}};
  PartialMap partial;
  std::vector<TrainingImage> kept;
  for (const std::size_t i : spaced(*map, outsideGap(map->size(), gap), spacing_m)) {
    kept.push_back(map->image(i));
    partial.images.push_back(i);
  }
  partial.map = std::make_shared<TrainingMap>(map->header(), std::move(kept));
  return partial;
}

namespace {

/// A training image whose true pose is known, in the map frame.
struct KnownImage {
  Eigen::Vector2d true_position_m = Eigen::Vector2d::Zero();
  std::optional<double> true_yaw_rad;
  MapError error;
};

std::vector<KnownImage> knownImages(const PartialMap& part, const std::vector<std::optional<TruePose>>& truth) {
  std::vector<KnownImage> known;
  const TrainingMap& map = *part.map;
  for (std::size_t i = 0; i < map.size() && !truth.empty(); ++i) {
    const std::optional<TruePose>& pose = truth[part.images.empty() ? i : part.images[i]];
    if (!pose || (map.hasGeometry() && !map.geometry(i))) continue;
    KnownImage image{map.frame().toEastNorth(pose->position), pose->yaw_rad, {}};
    image.error.position_m = map.position_m(i) - image.true_position_m;
    if (pose->yaw_rad) image.error.yaw_rad = angleDifference(*pose->yaw_rad, map.yaw_rad(i));
    known.push_back(image);
  }
  return known;
}

bool mayFaceAlike(const std::optional<double>& yaw_rad, const std::optional<double>& other_rad) {
  return !yaw_rad || !other_rad || faceAlike(*yaw_rad, *other_rad);
}

std::optional<MapError> errorAt(const std::vector<KnownImage>& images, const Eigen::Vector2d& position_m,
                                const std::optional<double>& yaw_rad) {
  std::optional<MapError> error;
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const KnownImage& image : images) {
    const double distance_m = (image.true_position_m - position_m).norm();
    if (distance_m >= nearest_m || !mayFaceAlike(yaw_rad, image.true_yaw_rad)) continue;
    nearest_m = distance_m;
    error = image.error;
  }
  return error;
}

}  // namespace

std::vector<std::optional<MapError>> mapErrors(const PartialMap& part,
                                               const std::vector<std::optional<TruePose>>& truth, const Drive& drive) {
  const std::vector<KnownImage> images = knownImages(part, truth);
  std::vector<std::optional<MapError>> errors;
  for (const DriveImage& image : drive.images) {
    errors.push_back(image.truth
                         ? errorAt(images, part.map->frame().toEastNorth(image.truth->position), image.truth->yaw_rad)
                         : std::nullopt);
  }
  return errors;
}

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
std::uint32_t seedOf(const MethodSpec& method, std::size_t start) {
  constexpr std::uint32_t kLargest = 0x7FFFFFFF;
  return (static_cast<std::uint32_t>(method.localizer.seed) + static_cast<std::uint32_t>(start)) & kLargest;
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

RunRecord run(const RunContext& context, const MethodSpec& method, std::size_t start, bool trace) {
  const auto image = std::make_shared<RecordedImage>(context.table, context.map.images, method.localizer.match,
                                                     method.localizer.similarity);
  const auto tested = makeTestedMethod(method, seedOf(method, start), context, image);
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

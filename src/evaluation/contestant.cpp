#include "visual_localization/evaluation/contestant.h"

#include <utility>
#include <vector>

#include "visual_localization/localizer/localizer.h"

namespace visual_localization {
namespace {

LocalizerConfig seeded(LocalizerConfig config, std::uint32_t seed) {
  config.seed = static_cast<int>(seed);
  return config;
}

/// A tracker, run by the localizer that runs on the robot.
class TrackerContestant final : public Contestant {
 public:
  TrackerContestant(std::shared_ptr<const TrainingMap> map, const LocalizerConfig& config)
      : similarity_(config.similarity), localizer_(std::move(map), config) {}

  Verdict process(std::int64_t stamp_ns, RecordedImage& image) override {
    const Estimate estimate = localizer_.process(stamp_ns, image);
    confidence_ += kNewest * (evidenceOf(estimate) - confidence_);
    return {estimate.pose.position_m, confidence_, estimate.features, estimate.comparisons, estimate};
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
  /// Weight of the newest image in the confidence: about five images count, as for the state.
  static constexpr double kNewest = 1.0 / 3.0;

  /// The best match in units of what counts as recognised, so that both kinds of features can be compared; none when
  /// the match is not where the estimate is.
  double evidenceOf(const Estimate& estimate) const {
    constexpr double kNear_m = 5.0;
    if (estimate.best_distance_m > kNear_m) return 0.0;
    const double recognised =
        estimate.features == FeatureKind::kSift ? similarity_.sift_recognised : similarity_.global_recognised;
    return recognised > 0.0 ? estimate.best.similarity / recognised : estimate.best.similarity;
  }

  SimilarityConfig similarity_;
  Localizer localizer_;
  double confidence_ = 0.0;
};

class RecogniserContestant final : public Contestant {
 public:
  RecogniserContestant(std::shared_ptr<const TrainingMap> map, const MethodSpec& method, bool closed)
      : map_(std::move(map)),
        features_(method.localizer.features == "global" ? FeatureKind::kGlobal : FeatureKind::kSift),
        recogniser_(makePlaceRecogniser(method.tracker, method.recogniser, closed)) {}

  Verdict process(std::int64_t, RecordedImage& image) override {
    image.row(features_, row_);
    const Recognition recognition = recogniser_->update(row_);
    return {map_->position_m(recognition.training_image), recognition.confidence, features_, row_.size(), {}};
  }

 private:
  std::shared_ptr<const TrainingMap> map_;
  FeatureKind features_;
  std::unique_ptr<PlaceRecogniser> recogniser_;
  std::vector<double> row_;
};

}  // namespace

std::unique_ptr<Contestant> makeContestant(const MethodSpec& method, std::shared_ptr<const TrainingMap> map,
                                           std::uint32_t seed, bool closed) {
  if (method.isTracker()) return std::make_unique<TrackerContestant>(std::move(map), seeded(method.localizer, seed));
  return std::make_unique<RecogniserContestant>(std::move(map), method, closed);
}

}  // namespace visual_localization

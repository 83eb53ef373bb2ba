#include "visual_localization/localizer/localizer.h"

#include <chrono>
#include <utility>

#include "visual_localization/geo/angles.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

using Clock = std::chrono::steady_clock;

double millisecondsSince(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

const LocalizerConfig& validated(const LocalizerConfig& config) {
  const auto wrong = config.violations();
  if (!wrong.empty()) throw ParameterError(wrong.front());
  return config;
}

std::unique_ptr<Tracker> makeTracker(const TrainingMap& map, const LocalizerConfig& config) {
  const auto seed = static_cast<std::uint32_t>(config.seed);
  if (config.tracker == "dpso") return std::make_unique<Dpso>(map, config.dpso, config.fitness, seed);
  return std::make_unique<ParticleFilter>(map, makeMotionModel(config.tracker, config.pf), config.pf, config.fitness,
                                          seed);
}

}  // namespace

Localizer::Localizer(std::shared_ptr<const TrainingMap> map, const LocalizerConfig& config)
    : map_(std::move(map)),
      config_(validated(config)),
      front_end_(map_->header().sift, config_.match, map_->header().image_size, config_.prune, config_.max_image_gap_s),
      similarity_(std::make_unique<SiftSimilarity>(config_.match)),
      scores_(map_->size()),
      tracker_(makeTracker(*map_, config_)),
      assessor_(config_.state) {}

Estimate Localizer::process(std::int64_t stamp_ns, const cv::Mat& grey) {
  const auto start = Clock::now();
  const Observation observation = front_end_.observe(stamp_ns, grey);
  const double extract_ms = millisecondsSince(start);
  Estimate estimate = process(observation);
  estimate.times.extract_ms = extract_ms;
  return estimate;
}

Estimate Localizer::process(const Observation& observation) {
  double match_ms = 0.0;
  const auto start = Clock::now();
  scores_.startImage([&](std::size_t image) {
    const auto comparison_start = Clock::now();
    const Score score = similarity_->compare(observation.features, map_->image(image));
    match_ms += millisecondsSince(comparison_start);
    return score;
  });
  const TrackerEstimate tracked = tracker_->update(scores_);

  Estimate estimate;
  estimate.stamp_ns = observation.stamp_ns;
  estimate.tuning = tracker_->tuning();
  estimate.state = assessor_.assess(tracked, estimate.tuning.recovering);
  estimate.pose = poseOf(tracked, estimate.state);
  estimate.best = tracked.best;
  estimate.best_image = tracked.best_image;
  estimate.comparisons = scores_.comparisons();
  estimate.features_extracted = observation.features_extracted;
  estimate.features_kept = observation.features.sift.size();
  estimate.spread_m = tracked.spread_m;
  estimate.times = {0.0, match_ms, millisecondsSince(start) - match_ms};
  last_features_ = observation.features;
  return estimate;
}

void Localizer::relocalize() { relocalize(anywhere(map_->area())); }

void Localizer::relocalize(const Prior& prior) {
  tracker_->reset(prior);
  assessor_.reset();
}

/// While the images confirm the position the covariance is that of its mode; otherwise that of the whole cloud
/// about it, so that nothing downstream trusts a guess.
PoseEstimate Localizer::poseOf(const TrackerEstimate& tracked, LocalizationState state) const {
  const double floor_m2 = config_.min_position_std_m * config_.min_position_std_m;
  PoseEstimate pose;
  pose.position_m = tracked.position_m;
  pose.covariance_m2 = state == LocalizationState::kTracking ? tracked.mode_covariance_m2 : tracked.cloud_covariance_m2;
  pose.covariance_m2 += floor_m2 * Eigen::Matrix2d::Identity();
  pose.yaw_rad = map_->image(tracked.training_image).yaw_rad;
  pose.yaw_variance_rad2 = yawVariance(tracked);
  pose.geodetic = map_->frame().toGeodetic(tracked.position_m);
  return pose;
}

/// How much the headings of the training images around the position differ from the one that is reported.
double Localizer::yawVariance(const TrackerEstimate& tracked) const {
  constexpr std::size_t kNeighbours = 5;
  const auto neighbours = map_->nearest(tracked.position_m, kNeighbours);
  double squares = 0.0;
  for (const Neighbour& neighbour : neighbours) {
    const double difference =
        angleDifference(map_->image(tracked.training_image).yaw_rad, map_->image(neighbour.image).yaw_rad);
    squares += difference * difference;
  }
  const double floor_rad2 = config_.min_yaw_std_rad * config_.min_yaw_std_rad;
  return floor_rad2 + squares / static_cast<double>(neighbours.size());
}

}  // namespace visual_localization

#include "visual_localization/localization/localizer.h"

#include <cmath>
#include <utility>

#include "base/time.h"
#include "localization/heading.h"
#include "visual_localization/geo/geodetic_point.h"
#include "visual_localization/localization/scores.h"
#include "visual_localization/localization/tracker_factory.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

const LocalizerConfig& validated(const LocalizerConfig& config) {
  const auto wrong = config.violations();
  if (!wrong.empty()) throw ParameterError(wrong.front());
  return config;
}

TrackerConfig trackerConfigOf(const LocalizerConfig& config) {
  return {config.tracker, config.dpso, config.pf, config.fitness};
}

}  // namespace

Localizer::Localizer(std::shared_ptr<const TrainingMap> map, const LocalizerConfig& config)
    : map_(std::move(map)),
      config_(validated(config)),
      front_end_(map_->header().sift, config_.match, map_->header().image_size, config_.prune, config_.max_image_gap_s,
                 config_.sift_backend),
      sift_similarity_(config_.match, config_.similarity),
      global_similarity_(config_.similarity),
      scores_(map_->size()),
      places_(map_->size(), static_cast<std::size_t>(config_.max_proposal_images), map_->globalsKept()),
      tracker_(makeTracker(*map_, trackerConfigOf(config_), static_cast<std::uint32_t>(config_.seed))),
      choice_(config_.features, config_.hybrid),
      place_check_(*map_, static_cast<std::size_t>(config_.state.place_check_images), config_.state.max_distance_m),
      assessor_(config_.state) {}

Estimate Localizer::process(std::int64_t stamp_ns, const cv::Mat& grey) {
  const Stopwatch stopwatch;
  front_end_.setImage(stamp_ns, grey);
  repeats_.add(stamp_ns, front_end_.isRepeated());
  Estimate estimate = isNews(stamp_ns) ? look(stamp_ns) : lastAgain(stamp_ns);
  estimate.look = front_end_.look();
  estimate.repeats = repeats_.images;
  estimate.frozen = isFrozen();
  estimate.times.extract_ms = front_end_.extract_ms();
  estimate.times.update_ms = stopwatch.elapsed_ms() - estimate.times.extract_ms - estimate.times.match_ms;
  last_ = estimate;
  if (estimate.frozen) doubt();
  return *last_;
}

/// The same stamp with the same pixels is the same image, come twice.
bool Localizer::isNews(std::int64_t stamp_ns) const {
  if (!last_ || !front_end_.isRepeated()) return true;
  return config_.state.frozen_images == 0 && last_->stamp_ns != stamp_ns;
}

Estimate Localizer::look(std::int64_t stamp_ns) {
  last_.reset();  // should this image fail, its repetition must not get the answer of the one before
  LiveImage image(front_end_, *map_, sift_similarity_, global_similarity_);
  Estimate estimate = process(stamp_ns, image);
  estimate.features_extracted = front_end_.siftExtracted();
  if (const SiftFeatures* sift = front_end_.siftIfExtracted()) estimate.features_kept = sift->size();
  estimate.times.match_ms = image.match_ms();
  return estimate;
}

Estimate Localizer::lastAgain(std::int64_t stamp_ns) const {
  Estimate estimate = *last_;
  estimate.stamp_ns = stamp_ns;
  estimate.times = {};
  return estimate;
}

void Localizer::Repeats::add(std::int64_t stamp_ns, bool repeated) {
  if (repeated) {
    ++images;
    at_one_stamp = stamp_ns == last_ns ? at_one_stamp + 1 : 0;
  } else {
    *this = {};
    first_ns = stamp_ns;
  }
  last_ns = stamp_ns;
}

/// Even a camera that stands still has noise: an image that stays says nothing about where the robot is by now.
bool Localizer::isFrozen() const {
  constexpr std::size_t kStuck = 30;  // a driver that sends its last image with its old stamp, on and on
  const auto least = static_cast<std::size_t>(config_.state.frozen_images);
  if (least == 0 || repeats_.images < least) return false;
  return std::abs(secondsBetween(repeats_.first_ns, repeats_.last_ns)) >= config_.state.frozen_time_s ||
         repeats_.at_one_stamp >= kStuck;
}

Estimate Localizer::process(std::int64_t stamp_ns, ComparableImage& image) {
  const FeatureKind features = choice_.next();
  scores_.startImage([&](std::size_t i) { return image.compare(features, i); });
  places_.startImage([&](std::size_t i) { return image.compare(FeatureKind::kGlobal, i).weight; });
  const TrackerEstimate& tracked = tracked_ = tracker_->update({scores_, places_});
  const Evidence evidence = evidenceOf(stamp_ns, tracked, features, image);

  Estimate estimate;
  estimate.stamp_ns = stamp_ns;
  estimate.features = features;
  estimate.tuning = tracker_->tuning();
  estimate.state = assessor_.assess(tracked, evidence);
  choice_.update(tracked.spread_m, assessor_.lastConfirms(), assessor_.isDoubtful());
  estimate.place_ratio = evidence.place_ratio;
  estimate.blind = evidence.blind;
  estimate.course_residual_m = assessor_.courseResidual_m();
  estimate.pose = poseOf(tracked, estimate.state);
  estimate.best = tracked.best;
  estimate.best_image = tracked.best_image;
  estimate.best_distance_m = tracked.best_distance_m;
  estimate.comparisons = scores_.comparisons();
  estimate.spread_m = tracked.spread_m;
  return estimate;
}

/// Asks the second witness only when the first is not sure, so that SIFT alone does without global features while all
/// is well.
Evidence Localizer::evidenceOf(std::int64_t stamp_ns, const TrackerEstimate& tracked, FeatureKind features,
                               ComparableImage& image) {
  const StateConfig& state = config_.state;
  Evidence evidence{stamp_ns, features, tracker_->tuning().recovering};
  const bool sift = features == FeatureKind::kSift;
  const bool sure =
      sift && tracked.best.similarity >= state.sure_similarity && tracked.best_distance_m <= state.max_distance_m;
  if (state.place_check && !sure) evidence.place_ratio = place_check_.ratio(image, tracked.position_m);
  evidence.blind =
      sift ? image.siftFeatures() < static_cast<std::size_t>(state.min_features) : tracked.best.similarity <= 0.0;
  return evidence;
}

void Localizer::configure(const LocalizerConfig& config) {
  const LocalizerConfig before = std::exchange(config_, LocalizerConfig(validated(config)));
  front_end_.configure(config_.match, config_.prune, config_.max_image_gap_s);
  sift_similarity_ = SiftSimilarity(config_.match, config_.similarity);
  global_similarity_ = GlobalSimilarity(config_.similarity);
  if (config_.max_proposal_images != before.max_proposal_images) {
    places_ = PlaceProposal(map_->size(), static_cast<std::size_t>(config_.max_proposal_images), map_->globalsKept());
  }
  place_check_.configure(static_cast<std::size_t>(config_.state.place_check_images), config_.state.max_distance_m);
  choice_.configure(config_.features, config_.hybrid);
  assessor_.configure(config_.state);
  configureTracker(before.tracker);
  last_.reset();
}

void Localizer::configureTracker(const std::string& tracker_before) {
  const TrackerConfig config = trackerConfigOf(config_);
  if (config.tracker == tracker_before && config.particles() == tracker_->particles().size()) {
    tracker_->configure(config);
    return;
  }
  auto successor = makeTracker(*map_, config, static_cast<std::uint32_t>(config_.seed));
  successor->reset(drawnFrom(tracker_->particles()));
  tracker_ = std::move(successor);
}

void Localizer::relocalize() {
  tracker_->reset();
  choice_.reset();
  assessor_.reset();
  last_.reset();
}

void Localizer::relocalize(const Prior& prior) {
  tracker_->reset(prior);
  choice_.reset();
  assessor_.reset();
  last_.reset();
}

LocalizationState Localizer::doubt() {
  const LocalizationState state = assessor_.doubt(tracker_->tuning().recovering);
  if (last_) {
    last_->state = state;
    last_->pose = poseOf(tracked_, state);
  }
  return state;
}

/// While the images confirm the position the covariance is that of its mode; otherwise that of the whole cloud
/// about it, so that nothing downstream trusts a guess.
PoseEstimate Localizer::poseOf(const TrackerEstimate& tracked, LocalizationState state) {
  const double floor_m2 = config_.min_position_std_m * config_.min_position_std_m;
  PoseEstimate pose;
  pose.position_m = tracked.position_m;
  pose.covariance_m2 = state == LocalizationState::kTracking ? tracked.mode_covariance_m2 : tracked.cloud_covariance_m2;
  pose.covariance_m2 += floor_m2 * Eigen::Matrix2d::Identity();
  const bool recognised = tracked.best.recognised && tracked.best_distance_m <= config_.state.max_distance_m;
  const Heading heading = headingOf(*map_, tracked, recognised, neighbours_);
  pose.yaw_rad = heading.yaw_rad;
  pose.yaw_variance_rad2 = heading.variance_rad2 + config_.min_yaw_std_rad * config_.min_yaw_std_rad;
  pose.geodetic = map_->frame().toGeodetic(tracked.position_m);
  return pose;
}

}  // namespace visual_localization

#include "visual_localization/localization/localizer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/time.h"
#include "localization/image_likelihood.h"
#include "localization/place_filter.h"
#include "localization/pose_verifier.h"
#include "localization/session_choice.h"
#include "visual_localization/localization/estimate.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

constexpr std::size_t kSweptImages = 20;  ///< those of the whole map that look most alike: a few positions

}  // namespace

Localizer::Localizer(std::shared_ptr<const TrainingMap> map, const LocalizerConfig& config)
    : Localizer(
          map, config,
          std::make_shared<LiveImage>(*map, frontEndConfigOf(requireValid(config), map->header()), config.similarity)) {
}

Localizer::Localizer(std::shared_ptr<const TrainingMap> map, const LocalizerConfig& config,
                     std::shared_ptr<QueryImage> image)
    : map_(std::move(map)),
      config_(requireValid(config)),
      camera_(map_->header().sessions.front().camera),
      mask_(map_->header().sessions.front().mask),
      mount_(map_->header().sessions.front().mount.value_or(SensorMount())),
      image_(std::move(image)),
      scores_(map_->size()),
      sweep_(*map_, static_cast<std::size_t>(config_.sweep_images), map_->globalsKept(), config_.proposals == "vlad"),
      tracker_(makeTracker(*map_, config_, static_cast<std::uint32_t>(config_.seed))),
      witness_(std::make_unique<PlaceFilter>(*map_, config_.bayes)),
      choice_(config_.features, config_.hybrid),
      assessor_(config_.state),
      odometry_(config_.odometry),
      sessions_(std::make_unique<SessionChoice>(*map_, config_.choose_session)),
      likelihood_(std::make_unique<ImageLikelihood>(scores_, sweep_, *sessions_, config_)),
      verifier_(std::make_unique<PoseVerifier>(*map_, config_.metric, *sessions_)) {
  requirePresetFits(config_, *map_);
  verifier_->predictor().useOdometry(odometry_, config_.odometry);
}

Localizer::~Localizer() = default;

MatchedLandmarks Localizer::lastLandmarks() const {
  return last_ && last_->metric ? verifier_->matched() : MatchedLandmarks();
}

Estimate Localizer::process(std::int64_t stamp_ns, const cv::Mat& grey) {
  const Stopwatch stopwatch;
  image_->set(stamp_ns, grey);
  repeats_.add(stamp_ns, image_->isRepeated());
  if (isRepetition(stamp_ns)) return lastAgain(stamp_ns, stopwatch.elapsed_ms());
  last_.reset();  // should this image fail, its repetition must not get the answer of the one before

  sessions_->startImage(stamp_ns);
  // A pose is solved where the motion leads; without success, where the tracker proposes.
  std::optional<MetricPose> metric = poseNearPrediction(stamp_ns);
  // Similarities to the training images are computed on demand, each at most once.
  scores_.startImage(metric ? FeatureKind::kLocal : choice_.next(),
                     [this](FeatureKind kind, std::size_t i) { return image_->compare(kind, i); });
  sweep_.startImage();
  const bool is_late = tracked_ns_ && stamp_ns < *tracked_ns_;
  const TrackerEstimate tracked = track(stamp_ns, metric);
  if (!metric) metric = poseNearProposal(tracked);
  sessions_->noteRecognition(metric || tracked.best.recognised);
  if (!metric && tracked.best.recognised) learnSession(tracked);
  const std::optional<PredictedPose> predicted = metric ? std::nullopt : verifiedMotion(tracked);
  Evidence evidence = verify(tracked, metric, predicted);
  if (is_late && evidence.probability) evidence.probability = 0.0;  // nobody knows how the robot came here
  const LocalizationState state = assessor_.update(stamp_ns, tracked, evidence);
  choice_.update(tracked.spread_m, assessor_.lastConfirms(), assessor_.isDoubtful());

  last_ = estimateOf(stamp_ns, tracked, metric, evidence, state);
  choosePose(*last_, predicted);
  explainLast(predicted, is_late);
  return answer(stopwatch.elapsed_ms());
}

/// The same pixels once more: an image that came twice has the same stamp, one of a frozen camera a new one.
bool Localizer::isRepetition(std::int64_t stamp_ns) const {
  if (!last_ || !image_->isRepeated()) return false;
  return config_.state.frozen_images > 0 || last_->stamp_ns == stamp_ns;
}

Estimate Localizer::estimateOf(std::int64_t stamp_ns, const TrackerEstimate& tracked,
                               const std::optional<MetricPose>& metric, const Evidence& evidence,
                               LocalizationState state) {
  Estimate estimate;
  estimate.stamp_ns = stamp_ns;
  estimate.state = state;
  estimate.metric = metric;
  estimate.images_since_metric = isMetric() ? verifier_->predictor().imagesSince() : 0;
  estimate.tracked = tracked;
  estimate.evidence = evidence;
  if (const auto session = sessions_->chosen()) estimate.session = map_->header().sessions[*session].name;
  if (isMetric()) {
    scores_.count(verifier_->compared());
    estimate.focal_scale = verifier_->focal().scale();
    estimate.camera_contradicted = verifier_->focal().contradicts();
    estimate.other_lens = isThroughOtherLens(tracked.best_image);
  }
  estimate.motion_residual_m = assessor_.motionResidual_m();
  estimate.comparisons = scores_.comparisons();
  estimate.swept = scores_.swept();
  estimate.image = image_->report();
  estimate.image.match_ms += geometry_ms_;
  return estimate;
}

Estimate Localizer::lastAgain(std::int64_t stamp_ns, double elapsed_ms) {
  last_->stamp_ns = stamp_ns;
  last_->image = image_->report();
  return answer(elapsed_ms);
}

/// The last estimate, after `elapsed_ms` since its image came. One of a camera that is frozen, or of an image too old
/// to say where the robot is by now, is in doubt.
Estimate Localizer::answer(double elapsed_ms) {
  last_->update_ms = elapsed_ms - last_->image.extract_ms - last_->image.match_ms;
  last_->repeats = repeats_.images;
  last_->frozen = isFrozen();
  if (last_->frozen || isStale()) {
    doubt();
    last_->why = {StateReason::kImageRepeated, static_cast<double>(repeats_.images)};
  }
  return *last_;
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

/// How long the last image has been coming.
double Localizer::Repeats::seconds() const { return std::abs(secondsBetween(first_ns, last_ns)); }

/// Whether the image repeats one from so long ago that a stream which repeats each to reach its rate does not.
bool Localizer::isStale() const {
  return config_.state.witness == "probability" && config_.state.frozen_images > 0 && repeats_.images > 0 &&
         repeats_.seconds() >= config_.state.frozen_time_s;
}

/// Even a camera that stands still has noise: an image that stays says nothing about where the robot is by now.
bool Localizer::isFrozen() const {
  constexpr std::size_t kStuck = 30;  // a driver that sends its last image with its old stamp, on and on
  const auto least = static_cast<std::size_t>(config_.state.frozen_images);
  if (least == 0 || repeats_.images < least) return false;
  return repeats_.seconds() >= config_.state.frozen_time_s || repeats_.at_one_stamp >= kStuck;
}

/// Compares global features only when the local ones are not sure.
Evidence Localizer::verify(const TrackerEstimate& tracked, const std::optional<MetricPose>& metric,
                           const std::optional<PredictedPose>& predicted) {
  const StateConfig& state = config_.state;
  Evidence evidence;
  if (isMetric() && !verifier_->focal().contradicts()) evidence.verified = metric && metric->confirmed;
  evidence.features = scores_.kind();
  const bool sift = evidence.features == FeatureKind::kLocal;
  evidence.blind =
      sift ? image_->localFeatures() < static_cast<std::size_t>(state.min_features) : tracked.best.similarity <= 0.0;
  Eigen::Vector2d claimed_m = predicted ? predicted->position_m : tracked.position_m;
  if (metric) claimed_m = metric->base.translation().head<2>();
  evidence.probability = probabilityOf(tracked, claimed_m);
  const double most_m = std::max(state.max_sigma_m, posterior().around_m());
  evidence.vague = evidence.probability && claimedSigma_m(tracked, metric, predicted) > most_m;
  if (evidence.probability && evidence.verified) {
    const bool confirms = *evidence.probability >= state.min_probability;
    missPose(metric.has_value(), predicted.has_value(), *evidence.probability);
    evidence.unverified = confirms && *evidence.probability < state.min_probability;
  }
  if (evidence.blind && evidence.probability) evidence.probability = 0.0;  // it shows no place
  const bool sure =
      sift && tracked.best.similarity >= state.sure_similarity && tracked.best_distance_m <= state.max_distance_m;
  if (state.place_check && !sure && !evidence.probability && !evidence.verified.value_or(false)) {
    evidence.place_ratio = sweep_.ratio(scores_, tracked.position_m, state.max_distance_m);
  }
  return evidence;
}

/// Whether landmarks can verify the pose of the current image.
bool Localizer::isMetric() const {
  return config_.metric.pose_source == "metric" && camera_ && map_->hasGeometry() && image_->unprunedLocal() != nullptr;
}

std::optional<MetricPose> Localizer::poseNearPrediction(std::int64_t stamp_ns) {
  geometry_ms_ = 0.0;
  if (!isMetric()) return std::nullopt;
  const Stopwatch stopwatch;
  const bool mapped = posterior().offMap() < config_.state.min_probability;
  verifier_->startImage(stamp_ns, *image_->unprunedLocal(), *camera_, mount_, mapped);
  std::optional<MetricPose> pose = verifier_->nearPrediction();
  geometry_ms_ = stopwatch.elapsed_ms();
  return pose;
}

std::optional<MetricPose> Localizer::poseNearProposal(const TrackerEstimate& tracked) {
  if (!isMetric()) return std::nullopt;
  const auto nearOneOf = [this](const std::vector<std::size_t>& training_images) {
    const Stopwatch stopwatch;
    std::optional<MetricPose> pose = verifier_->nearOneOf(training_images);
    geometry_ms_ += stopwatch.elapsed_ms();
    return pose;
  };
  std::optional<MetricPose> pose = nearOneOf(scores_.mostSimilar());
  // Wherever that may be. The sweep's time is that of its features and comparisons, which are timed there.
  if (!pose) pose = nearOneOf(sweep_.mostSimilar(scores_, kSweptImages));
  if (!pose) return pose;
  PoseLikelihood verified(*map_, pose->base.translation().head<2>());
  tracker_->update(verified);
  bringTracker(tracked, *pose);
  return pose;
}

/// A verified pose takes the place of all comparisons but one: that with the training image whose landmarks agree most.
TrackerEstimate Localizer::track(std::int64_t stamp_ns, const std::optional<MetricPose>& metric) {
  Motion motion;
  if (tracked_ns_) {
    motion =
        Motion(secondsBetween(*tracked_ns_, stamp_ns), odometry_.between(*tracked_ns_, stamp_ns), config_.odometry);
  }
  tracked_ns_ = stamp_ns;
  tracker_->predict(motion);
  const TrackerEstimate tracked = metric ? trackVerified(*metric) : trackImage();
  witness(motion, metric);
  return tracked;
}

TrackerEstimate Localizer::trackImage() {
  tracker_->update(*likelihood_);
  return tracker_->belief();
}

TrackerEstimate Localizer::trackVerified(const MetricPose& metric) {
  const Eigen::Vector2d position_m = metric.base.translation().head<2>();
  const std::size_t best_image = verifier_->matched().training_image;
  const Score best = scores_[best_image];
  PoseLikelihood verified(*map_, position_m, Fitness{best.weight, best_image, best});
  tracker_->update(verified);
  TrackerEstimate tracked = tracker_->belief();
  bringTracker(tracked, metric);
  tracked.best_image = best_image;
  tracked.best = best;
  tracked.best_distance_m = (map_->position_m(tracked.best_image) - position_m).norm();
  return tracked;
}

/// A filter beside the tracker learns from what that one compares, and costs no comparison.
void Localizer::witness(const Motion& motion, const std::optional<MetricPose>& metric) {
  if (tracker_->posterior() != nullptr || config_.state.witness != "probability") return;
  witness_->predict(motion);
  if (metric) return witness_->update(witness_->around(metric->base.translation().head<2>()));
  if (scores_.kind() != FeatureKind::kLocal) return;
  witness_->update(witness_->likelihoodBeside(scores_.compared()));
}

/// Where the motion since the last verified pose leads to: that is the pose, whatever looks alike elsewhere, as long as
/// a velocity holds. Later, and where thresholds decide, a tracker that is elsewhere is believed; of odometry only one
/// that recognises its place. Poses by a calibration that the images contradict lead nowhere.
std::optional<PredictedPose> Localizer::verifiedMotion(const TrackerEstimate& tracked) {
  if (!isMetric() || verifier_->focal().contradicts()) return std::nullopt;
  const PosePredictor& predictor = verifier_->predictor();
  const std::optional<PredictedPose> predicted = predictor.predicted();
  if (!predicted) return std::nullopt;
  const bool is_fresh = config_.state.witness == "probability" && predictor.byVelocity();
  const bool knows_better = is_fresh || (predicted->by_odometry && !tracked.best.recognised);
  const double most_m = config_.state.max_distance_m;
  return knows_better || (predicted->position_m - placeOf_m(tracked)).norm() <= most_m ? predicted : std::nullopt;
}

/// What it says that landmarks verify no pose: the more of a drive have one, the less a place alone is believed. For a
/// while the verified motion speaks for itself.
void Localizer::missPose(bool has_pose, bool is_predicted, double& probability) {
  MissingPoses& missing = verifier_->missing();
  const double in_map = missing.likelihood() * probability;
  if (!has_pose && !is_predicted) probability = in_map / std::max(1e-12, in_map + 1.0 - probability);
  missing.add(has_pose, probability);
}

/// Around a position; by global features thresholds decide, as by choice.
std::optional<double> Localizer::probabilityOf(const TrackerEstimate& tracked,
                                               const Eigen::Vector2d& position_m) const {
  if (config_.state.witness != "probability" || scores_.kind() != FeatureKind::kLocal) return std::nullopt;
  if (isThroughOtherLens(tracked.best_image)) return 0.0;
  return posterior().probabilityWithin(position_m, hereRadius_m(tracked.best_image));
}

const PlaceFilter& Localizer::posterior() const {
  return tracker_->posterior() != nullptr ? *tracker_->posterior() : *witness_;
}

/// The images ask for a focal length that is farther from the map's than the calibration's is: then things look as
/// large from elsewhere, and the place that looks most alike is not the right one. Where only the calibration is wrong,
/// they ask for one nearer to the map's. They ask for less than the truth: on a street for 17 % where it is 25 %.
bool Localizer::isThroughOtherLens(std::size_t training_image) const {
  constexpr double kMost = 0.02;
  if (!isMetric() || !verifier_->focal().contradicts()) return false;
  const auto& trained = map_->header().sessions[static_cast<std::size_t>(map_->pose(training_image).session)].camera;
  if (!trained) return false;
  const double calibrated = std::log(camera_->intrinsics().fx / trained->intrinsics().fx);
  return std::abs(calibrated + std::log(verifier_->focal().scale())) > std::abs(calibrated) + kMost;
}

/// Without landmarks the most similar training image is compared with one of another session beside it.
void Localizer::learnSession(const TrackerEstimate& tracked) {
  const std::size_t best = tracked.best_image;
  const auto trial = sessions_->trial(map_->position_m(best), map_->yaw_rad(best));
  if (trial) sessions_->learn(best, tracked.best.weight, *trial, scores_[*trial].weight);
}

/// To a pose that landmarks confirm, from far away.
void Localizer::bringTracker(const TrackerEstimate& tracked, const MetricPose& metric) {
  const Eigen::Vector2d position_m = metric.base.translation().head<2>();
  const double farthest_m = std::max((tracked.position_m - position_m).norm(), tracked.spread_m.maxCoeff());
  if (metric.confirmed && farthest_m > config_.state.max_step_m) {
    tracker_->reset(normallyDistributed(position_m, Eigen::Matrix2d::Identity()));
  }
}

LocalizationState Localizer::doubt() {
  verifier_->predictor().doubtMotion();
  const LocalizationState state = assessor_.doubt(tracker_->belief().recovering);
  if (last_) {
    last_->state = state;
    if (!last_->metric) last_->pose = poseOf(last_->tracked, state);
  }
  return state;
}

}  // namespace visual_localization

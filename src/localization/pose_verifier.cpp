#include "localization/pose_verifier.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "base/numbers.h"
#include "base/time.h"
#include "geometry/rays.h"
#include "visual_localization/localization/estimate.h"

namespace visual_localization {
namespace {

constexpr std::size_t kFocalImages = 20;
constexpr double kLeastFocalSigma = 0.003;  ///< landmarks err alike for neighbouring images
constexpr double kSureFocalSigma = 0.01;    ///< a larger standard deviation of the mean says nothing yet
constexpr double kFocalSigmas = 3.0;

constexpr std::size_t kHypotheses = 2;  ///< of positions that look alike
constexpr double kApart_m = 5.0;        ///< training images closer than this belong to one hypothesis

Eigen::Matrix3d covarianceOf(const SeenLandmark& landmark) {
  const Eigen::Vector3d ray = landmark.offset_m.cast<double>().normalized();
  const double along = landmark.sigma_along_m;
  const double across = landmark.sigma_across_m;
  return across * across * Eigen::Matrix3d::Identity() + (along * along - across * across) * ray * ray.transpose();
}

/// That of the camera's pose as that of the robot's: a rotation about the camera moves it.
MetricPose::Covariance atBase(const MetricPose::Covariance& of_camera, const MetricPose& pose) {
  MetricPose::Covariance by_camera = MetricPose::Covariance::Identity();
  by_camera.topRightCorner<3, 3>() = -crossMatrix(pose.base.translation() - pose.camera.position_m);
  return by_camera * of_camera * by_camera.transpose();
}

}  // namespace

void FocalCheck::add(double scale, double sigma) {
  if (!std::isfinite(scale) || !std::isfinite(sigma)) return;
  if (std::exchange(added_, true)) {
    images_.pop_back();
  } else if (images_.size() == kFocalImages) {
    images_.erase(images_.begin());
  }
  images_.push_back({scale, 1.0 / (sigma * sigma + kLeastFocalSigma * kLeastFocalSigma)});
}

double FocalCheck::scale() const {
  double sum = 0.0;
  double weights = 0.0;
  for (const Image& image : images_) {
    sum += image.weight * image.scale;
    weights += image.weight;
  }
  return weights > 0.0 ? sum / weights : 1.0;
}

double FocalCheck::sigma() const {
  double weights = 0.0;
  for (const Image& image : images_) weights += image.weight;
  return 1.0 / std::sqrt(weights);
}

bool FocalCheck::contradicts() const {
  return !images_.empty() && std::abs(scale() - 1.0) > max_error_ + kFocalSigmas * sigma();
}

bool FocalCheck::confirms() const { return !images_.empty() && sigma() <= kSureFocalSigma && !contradicts(); }

void MotionEvidence::add(double gain) { sum_ = std::clamp(sum_ + std::min(gain, kMostOfOne), 0.0, kMost); }

void PoseVerifier::configure(const MetricConfig& config) {
  config_ = config;
  focal_.configure(config.max_focal_error);
}

void PoseVerifier::reset() {
  last_.reset();
  inliers_together_ = 0;
  elsewhere_ = 0;
  moving_ = {};
  moving_gain_ = 0.0;
}

void PoseVerifier::doubtMotion() {
  if (last_) last_->velocity_holds = false;
}

void PoseVerifier::useOdometry(const OdometryTrack& track, const OdometryConfig& config) {
  odometry_ = &track;
  odometry_config_ = config;
}

void PoseVerifier::startImage(std::int64_t stamp_ns, const SiftFeatures& features, const CameraModel& camera,
                              const SensorMount& mount) {
  ++images_since_;
  focal_.startImage();
  moving_.add(std::exchange(moving_gain_, 0.0));
  stamp_ns_ = stamp_ns;
  features_ = &features;
  rays_ = raysOf(features, camera, config_.keypoint_sigma_px);
  focal_px_ = camera.intrinsics().fx;
  mount_ = mount;
  compared_.clear();
}

/// Wheels may slip: then the velocity before may still lead there.
std::optional<MetricPose> PoseVerifier::nearPrediction() {
  const std::optional<MetricPose> pose = near(byOdometry());
  return pose ? pose : near(byVelocity());
}

std::optional<MetricPose> PoseVerifier::near(const std::optional<Prediction>& prediction) {
  if (!prediction) return std::nullopt;
  const auto few = static_cast<std::size_t>(std::min(config_.min_inliers, config_.min_inliers_predicted));
  std::vector<std::size_t> images =
      sessions_.around(prediction->position_m, prediction->yaw_rad, static_cast<std::size_t>(config_.training_images));
  const std::optional<std::size_t> trial = sessions_.trial(prediction->position_m, prediction->yaw_rad);
  if (trial) images.push_back(*trial);
  const auto pose = solveAround(prediction->position_m, prediction->yaw_rad, images, few, trial);
  if (!pose) return std::nullopt;
  if (pose->inliers < static_cast<std::size_t>(config_.min_inliers) && !isPredicted(*pose)) return std::nullopt;
  return accepted(*pose);
}

std::optional<MetricPose> PoseVerifier::nearOneOf(const std::vector<std::size_t>& training_images) {
  std::vector<Eigen::Vector2d> tried;
  for (const std::size_t image : training_images) {
    const Eigen::Vector2d& position_m = map_.position_m(image);
    if (std::any_of(tried.begin(), tried.end(),
                    [&](const Eigen::Vector2d& other) { return (other - position_m).norm() < kApart_m; })) {
      continue;
    }
    tried.push_back(position_m);
    const auto pose = solveAround(position_m, map_.yaw_rad(image),
                                  sessions_.aroundLike(image, static_cast<std::size_t>(config_.training_images)),
                                  static_cast<std::size_t>(config_.min_inliers));
    if (pose) {
      sessions_.choose(matched_.training_image);
      return accepted(*pose);
    }
    if (tried.size() == kHypotheses) break;
  }
  return std::nullopt;
}

std::vector<std::size_t> PoseVerifier::compared() const {
  std::vector<std::size_t> images;
  for (const Compared& compared : compared_) images.push_back(compared.training_image);
  return images;
}

/// By the landmarks of these training images of one session. Where they make no pose that would be TRACKING, those of
/// the nearest images of all sessions join them: what looks most alike need not have the best landmarks.
std::optional<MetricPose> PoseVerifier::solveAround(const Eigen::Vector2d& position_m, double yaw_rad,
                                                    std::vector<std::size_t> images, std::size_t min_inliers,
                                                    std::optional<std::size_t> trial) {
  const std::optional<MetricPose> pose = solve(images, min_inliers, trial);
  if (pose && isClear(*pose)) return pose;
  const std::size_t of_session = images.size();
  for (const std::size_t image :
       sessions_.aroundAny(position_m, yaw_rad, static_cast<std::size_t>(config_.training_images))) {
    if (std::find(images.begin(), images.end(), image) == images.end()) images.push_back(image);
  }
  if (images.size() == of_session) return pose;
  const std::optional<MetricPose> by_all = solve(images, min_inliers);
  return by_all ? by_all : pose;
}

/// `trial`: the last of the training images, if its session is being tried.
std::optional<MetricPose> PoseVerifier::solve(const std::vector<std::size_t>& images, std::size_t min_inliers,
                                              std::optional<std::size_t> trial) {
  if (images.empty()) return std::nullopt;
  std::vector<LandmarkMatch> sights;
  std::vector<Pair> seen;  // training images share landmarks
  for (const std::size_t image : images) {
    for (const Match& match : matchesWith(image)) {
      const Pair pair(match.landmark, match.feature);
      if (std::find(seen.begin(), seen.end(), pair) != seen.end()) continue;
      seen.push_back(pair);
      sights.push_back(match.sight);
    }
  }
  const auto solved = solvePose(sights, config_.tolerance_px / focal_px_, min_inliers, moving_.sum());
  if (!solved) return std::nullopt;
  moving_gain_ = solved->moving_gain;
  std::vector<Pair> inliers;
  for (const std::size_t i : solved->inliers) inliers.push_back(seen[i]);
  const std::vector<std::size_t> agreeing = keepMatched(images, std::move(inliers));
  if (trial)
    sessions_.learn(images.front(), static_cast<double>(agreeing.front()), *trial,
                    static_cast<double>(agreeing.back()));
  MetricPose pose;
  pose.camera = solved->camera;
  pose.base = mount_.baseInMap(pose.camera);
  pose.covariance = config_.sigma_factor * config_.sigma_factor * atBase(solved->covariance, pose);
  pose.inliers = solved->agreeing;
  pose.reprojection_px = solved->median_error * focal_px_;
  if (const auto geometry = map_.geometry(images.front())) pose.map_covariance = atBase(geometry->covariance, pose);
  focal_.add(solved->focal_scale, solved->focal_sigma);
  const bool is_sure = pose.sigma_m() <= config_.max_sigma_m;
  return is_sure && !focal_.contradicts() ? std::optional<MetricPose>(pose) : std::nullopt;
}

/// Each training image is compared at most once.
const std::vector<PoseVerifier::Match>& PoseVerifier::matchesWith(std::size_t training_image) {
  const auto known = std::find_if(compared_.begin(), compared_.end(), [training_image](const Compared& compared) {
    return compared.training_image == training_image;
  });
  if (known != compared_.end()) return known->matches;
  compared_.push_back({training_image, {}});
  const std::shared_ptr<const ImageGeometry> geometry = map_.geometry(training_image);
  if (geometry) match(training_image, *geometry, compared_.back().matches);
  return compared_.back().matches;
}

void PoseVerifier::match(std::size_t training_image, const ImageGeometry& geometry, std::vector<Match>& matches) {
  indices_.clear();
  for (const SeenLandmark& landmark : geometry.landmarks) indices_.push_back(landmark.feature);
  const std::shared_ptr<const SiftFeatures> features = map_.sift(training_image);
  if (!indices_.empty() && indices_.back() >= features->size()) return;  // they could not be read
  features->subset(indices_, landmarks_);
  matchSymmetric(*features_, landmarks_, config_.match_ratio, found_);
  const int session = map_.pose(training_image).session;
  for (const FeatureMatch& pair : found_) {
    if (!rays_.normalised[pair.a].allFinite()) continue;
    const SeenLandmark& landmark = geometry.landmarks[pair.b];
    matches.push_back({landmark.id,
                       pair.a,
                       landmark.feature,
                       {pair.a, session, rays_.normalised[pair.a], rays_.sigmas[pair.a],
                        geometry.camera.position_m + landmark.offset_m.cast<double>(), covarianceOf(landmark)}});
  }
}

/// How many inliers each training image shows.
std::vector<std::size_t> PoseVerifier::keepMatched(const std::vector<std::size_t>& training_images,
                                                   std::vector<Pair> inliers) {
  std::sort(inliers.begin(), inliers.end());
  std::vector<std::size_t> counts;
  std::size_t most = 0;
  for (const std::size_t image : training_images) {
    MatchedLandmarks matched{image, {}};
    std::size_t agreeing = 0;
    for (const Match& match : matchesWith(image)) {
      const SiftKeypoint& keypoint = features_->keypoints()[match.feature];
      const bool inlier = std::binary_search(inliers.begin(), inliers.end(), Pair(match.landmark, match.feature));
      matched.landmarks.push_back({{keypoint.x_px, keypoint.y_px}, match.training_feature, inlier});
      agreeing += inlier ? 1 : 0;
    }
    counts.push_back(agreeing);
    if (agreeing <= most) continue;
    most = agreeing;
    matched_ = std::move(matched);
  }
  return counts;
}

/// Of this pose and of those before it that it follows.
std::size_t PoseVerifier::inliersTogether(const MetricPose& pose) const {
  return (follows(pose) ? inliers_together_ : 0) + pose.inliers;
}

/// Whether enough landmarks agree for TRACKING.
bool PoseVerifier::isClear(const MetricPose& pose) const {
  return inliersTogether(pose) >= static_cast<std::size_t>(config_.min_inliers_tracking);
}

std::optional<MetricPose> PoseVerifier::accepted(MetricPose pose) {
  if (isAside(pose)) return std::nullopt;
  const bool clear = isClear(pose);
  inliers_together_ = inliersTogether(pose);
  const std::optional<bool> odometry_agrees = odometryAgrees(pose);
  pose.confirmed = !isElsewhere(pose, odometry_agrees) && focal_.confirms() && clear;
  if (odometry_agrees) judgeOdometry(*odometry_agrees);
  Known known{stamp_ns_, pose, {}, 0.0, true};
  if (last_ && last_->velocity_holds) {
    const double elapsed_s = secondsBetween(last_->stamp_ns, stamp_ns_);
    if (elapsed_s > 0.0 && elapsed_s <= config_.max_gap_s) {
      known.velocity_mps = (pose.base.translation() - last_->pose.base.translation()).head<2>() / elapsed_s;
      known.turned_rad = angleDifference(yawOf(last_->pose.base), yawOf(pose.base));
      if (isPredicted(pose)) speed_mps_ = known.velocity_mps->norm();  // two that agree
    }
  }
  last_ = known;
  images_since_ = 0;
  return pose;
}

// Where the motion since the last verified pose leads, and what a pose says about it.

namespace {

constexpr double kTurn = 0.5;            ///< how far off the straight way a robot may be, as a share of the way
constexpr double kUnknownWay_m = 1.0;    ///< the same where one pose tells no speed
constexpr double kShortWay_m = 10.0;     ///< after a longer one a robot may be anywhere
constexpr double kTurn_rad_per_m = 0.1;  ///< standard deviation of how much it turns on the way
constexpr double kSlipped_m = 0.3;       ///< odometry that is off by more, beside its own uncertainty, is wrong
constexpr double kSlipped_rad = 0.3;
constexpr std::size_t kImagesOfDistrust = 10;

/// Where odometry leads from `last`. A wrong heading moves it aside, the more the farther it goes.
PoseVerifier::Prediction predictedBy(const MetricPose& last, const OdometryIncrement& way,
                                     const OdometryConfig& config) {
  const MetricPose::Covariance covariance = last.covariance + last.map_covariance;
  const double turn_rad = config.turn_sigma_rad_m * way.distance_m;
  const Eigen::Vector2d way_m = Eigen::Rotation2Dd(yawOf(last.base)) * way.translation_m;
  const Eigen::Vector2d aside_m(-way_m.y(), way_m.x());
  const double yaw_variance = covariance(5, 5) + 0.25 * turn_rad * turn_rad;
  PoseVerifier::Prediction prediction;
  prediction.position_m = last.base.translation().head<2>() + way_m;
  prediction.yaw_rad = std::remainder(yawOf(last.base) + way.rotation_rad, 2.0 * kPi);
  prediction.sigma_m = config.distance_sigma * way.distance_m;
  prediction.covariance_m2 = covariance.topLeftCorner<2, 2>() +
                             prediction.sigma_m * prediction.sigma_m * Eigen::Matrix2d::Identity() +
                             yaw_variance * aside_m * aside_m.transpose();
  prediction.yaw_variance_rad2 = covariance(5, 5) + turn_rad * turn_rad;
  prediction.by_odometry = true;
  return prediction;
}

}  // namespace

std::optional<PoseVerifier::Prediction> PoseVerifier::predicted() const {
  const std::optional<Prediction> prediction = byOdometry();
  return prediction ? prediction : byVelocity();
}

std::optional<PoseVerifier::Prediction> PoseVerifier::byOdometry() const {
  if (!last_ || odometry_ == nullptr || distrust_ > 0) return std::nullopt;
  const auto way = odometry_->between(last_->stamp_ns, stamp_ns_);
  if (!way || way->distance_m > odometry_config_.max_distance_m) return std::nullopt;
  return predictedBy(last_->pose, *way, odometry_config_);
}

std::optional<PoseVerifier::Prediction> PoseVerifier::byVelocity() const {
  if (!last_ || !last_->velocity_holds) return std::nullopt;
  const double elapsed_s = secondsBetween(last_->stamp_ns, stamp_ns_);
  if (!(elapsed_s >= 0.0 && elapsed_s <= config_.max_gap_s)) return std::nullopt;
  const MetricPose& last = last_->pose;
  const Eigen::Vector2d way_m = last_->velocity_mps.value_or(Eigen::Vector2d::Zero()) * elapsed_s;
  const MetricPose::Covariance covariance = last.covariance + last.map_covariance;
  Prediction prediction;
  prediction.position_m = last.base.translation().head<2>() + way_m;
  prediction.yaw_rad = yawOf(last.base);
  prediction.sigma_m = last_->velocity_mps ? kTurn * way_m.norm() : kUnknownWay_m;
  prediction.covariance_m2 =
      covariance.topLeftCorner<2, 2>() + prediction.sigma_m * prediction.sigma_m * Eigen::Matrix2d::Identity();
  const double turn_rad = kTurn_rad_per_m * way_m.norm();
  prediction.yaw_variance_rad2 = covariance(5, 5) + turn_rad * turn_rad;
  return prediction;
}

/// By odometry or by the velocity before; of a robot that turned as this pose says, along the arc.
bool PoseVerifier::isPredicted(const MetricPose& pose) const {
  const auto agrees = [&](const std::optional<Prediction>& expected) {
    return expected && (pose.base.translation().head<2>() - expected->position_m).norm() <=
                           config_.max_prediction_error_m + expected->sigma_m + 2.0 * pose.sigma_m();
  };
  std::optional<Prediction> by_velocity = byVelocity();
  if (agrees(byOdometry()) || agrees(by_velocity)) return true;
  if (!by_velocity) return false;
  const Eigen::Vector2d last_m = last_->pose.base.translation().head<2>();
  const double turned_rad = angleDifference(yawOf(last_->pose.base), yawOf(pose.base));
  const Eigen::Rotation2Dd along_arc(0.5 * (last_->turned_rad + turned_rad));
  by_velocity->position_m = last_m + along_arc * (by_velocity->position_m - last_m);
  return agrees(by_velocity);
}

/// Whether the robot may have driven here since the last verified pose: it is where the motion leads, or after a short
/// way no farther than by the speed that it had.
bool PoseVerifier::follows(const MetricPose& pose) const {
  if (isPredicted(pose)) return true;
  if (!last_ || !speed_mps_) return false;
  const double way_m = *speed_mps_ * secondsBetween(last_->stamp_ns, stamp_ns_);
  if (!(way_m >= 0.0 && way_m <= kShortWay_m)) return false;
  const double driven_m = (pose.base.translation() - last_->pose.base.translation()).head<2>().norm();
  return driven_m <= config_.max_prediction_error_m + (1.0 + kTurn) * way_m;
}

/// Whether the landmarks may be those of a thing that was moved since the day of the map, a parked car: the motion is
/// known from the last two images, and the pose is beside where it leads. A robot that was pushed aside is there in the
/// next image as well, and a kidnapped one is farther away.
bool PoseVerifier::isAside(const MetricPose& pose) const {
  if (images_since_ != 1 || !last_) return false;
  const std::optional<Prediction> expected = predicted();
  if (!expected || !(expected->by_odometry || last_->velocity_mps) || odometryAgrees(pose).value_or(false))
    return false;
  return !isPredicted(pose) && (pose.base.translation().head<2>() - expected->position_m).norm() < kApart_m;
}

/// Whether odometry since the last verified pose leads to this one; nothing when it does not know.
std::optional<bool> PoseVerifier::odometryAgrees(const MetricPose& pose) const {
  if (!last_ || odometry_ == nullptr) return std::nullopt;
  const auto way = odometry_->between(last_->stamp_ns, stamp_ns_);
  if (!way) return std::nullopt;
  const Prediction expected = predictedBy(last_->pose, *way, odometry_config_);
  const double off_m = (pose.base.translation().head<2>() - expected.position_m).norm();
  const double turned_rad = std::abs(angleDifference(expected.yaw_rad, yawOf(pose.base)));
  return off_m <= kSlipped_m + 3.0 * largerSigma(expected.covariance_m2) && turned_rad <= kSlipped_rad;
}

/// Wheels that slip or a robot that was carried: what odometry says is worth nothing until it agrees again for a while.
void PoseVerifier::judgeOdometry(bool agrees) {
  if (!agrees) {
    distrust_ = kImagesOfDistrust;
  } else if (distrust_ > 0) {
    --distrust_;
  }
}

/// Odometry that is believed leads elsewhere: the robot was carried, the wheels have slipped while nothing was seen, or
/// this is the twin of the place. The first two stay, and a few more poses along the motion tell.
bool PoseVerifier::isElsewhere(const MetricPose& pose, std::optional<bool> odometry_agrees) {
  const bool predicted = isPredicted(pose);
  if (byOdometry() && !odometry_agrees.value_or(true) && !predicted) {
    elsewhere_ = kImagesOfDistrust;
  } else if (!odometry_agrees && !byVelocity()) {
    elsewhere_ = 0;  // nobody knows any more how it came here
  } else if (elsewhere_ > 0 && (predicted || odometry_agrees.value_or(false))) {
    --elsewhere_;
  }
  return elsewhere_ > 0;
}

}  // namespace visual_localization

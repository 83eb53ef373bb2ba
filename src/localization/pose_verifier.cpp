#include "localization/pose_verifier.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "base/numbers.h"
#include "base/time.h"
#include "geometry/rays.h"
#include "visual_localization/localization/metric_pose.h"

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

bool FocalCheck::wouldContradict(double scale, double sigma) const {
  FocalCheck together = *this;
  together.add(scale, sigma);
  return together.contradicts();
}

bool FocalCheck::confirms() const { return !images_.empty() && sigma() <= kSureFocalSigma && !contradicts(); }

void MotionEvidence::add(double gain) { sum_ = std::clamp(sum_ + std::min(gain, kMostOfOne), 0.0, kMost); }

void MissingPoses::add(bool has_pose, double in_map) {
  constexpr double kMemory = 0.99;
  in_a_row_ = has_pose ? 0 : in_a_row_ + 1;
  missed_ = kMemory * missed_ + (has_pose ? 0.0 : in_map);
  seen_ = kMemory * seen_ + (has_pose ? 1.0 : 0.0);
}

/// Of a share that is not exactly known: images that follow each other miss for one reason.
double MissingPoses::likelihood() const {
  constexpr std::size_t kMost = 10;
  double likelihood = 1.0;
  for (std::size_t i = 0; i < std::min(in_a_row_ + 1, kMost); ++i) {
    const double missed = missed_ + static_cast<double>(i);
    likelihood *= missed / (missed + seen_);
  }
  return likelihood;
}

void PoseVerifier::configure(const MetricConfig& config) {
  config_ = config;
  focal_.configure(config.max_focal_error);
  predictor_.configure(config);
}

void PoseVerifier::reset() {
  predictor_.reset();
  missing_.restart();
  inliers_together_ = 0;
  moving_ = {};
  moving_gain_ = 0.0;
}

void PoseVerifier::startImage(std::int64_t stamp_ns, const LocalFeatures& features, const CameraModel& camera,
                              const SensorMount& mount, bool mapped) {
  mapped_ = mapped;
  predictor_.startImage(stamp_ns);
  focal_.startImage();
  moving_.add(std::exchange(moving_gain_, 0.0));
  features_ = &features;
  rays_ = raysOf(features, camera);
  focal_px_ = camera.intrinsics().fx;
  mount_ = mount;
  compared_.clear();
}

/// Wheels may slip: then the velocity before may still lead there.
std::optional<MetricPose> PoseVerifier::nearPrediction() {
  const std::optional<MetricPose> pose = near(predictor_.byOdometry());
  return pose ? pose : near(predictor_.byVelocity());
}

std::optional<MetricPose> PoseVerifier::near(const std::optional<PredictedPose>& prediction) {
  if (!prediction) return std::nullopt;
  const auto few = static_cast<std::size_t>(std::min(config_.min_inliers, config_.min_inliers_predicted));
  std::vector<std::size_t> images =
      sessions_.around(prediction->position_m, prediction->yaw_rad, static_cast<std::size_t>(config_.training_images));
  const std::optional<std::size_t> trial = sessions_.trial(prediction->position_m, prediction->yaw_rad);
  if (trial) images.push_back(*trial);
  const auto solution = solveAround(prediction->position_m, prediction->yaw_rad, images, few, trial);
  if (!solution) return std::nullopt;
  const bool enough = solution->pose.inliers >= static_cast<std::size_t>(config_.min_inliers);
  return commit(*solution, solution->holds && (enough || predictor_.isPredicted(solution->pose)));
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
    const auto solution = solveAround(position_m, map_.yaw_rad(image),
                                      sessions_.aroundLike(image, static_cast<std::size_t>(config_.training_images)),
                                      static_cast<std::size_t>(config_.min_inliers));
    if (solution) {
      const std::optional<MetricPose> pose = commit(*solution, solution->holds);
      if (pose) sessions_.choose(matched_.training_image);
      if (solution->holds) return pose;
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
/// the nearest images of all sessions join them: what looks most alike need not have the best landmarks. `trial`: the
/// last of the training images, if its session is being tried.
std::optional<PoseVerifier::Solution> PoseVerifier::solveAround(const Eigen::Vector2d& position_m, double yaw_rad,
                                                                std::vector<std::size_t> images,
                                                                std::size_t min_inliers,
                                                                std::optional<std::size_t> trial) {
  std::optional<Solution> solution = solve(images, min_inliers);
  if (solution && trial) {
    solution->trial = {images.front(), static_cast<double>(solution->agreeing.front()), *trial,
                       static_cast<double>(solution->agreeing.back())};
  }
  if (solution && solution->holds && isClear(solution->pose)) return solution;
  const std::size_t of_session = images.size();
  for (const std::size_t image :
       sessions_.aroundAny(position_m, yaw_rad, static_cast<std::size_t>(config_.training_images))) {
    if (std::find(images.begin(), images.end(), image) == images.end()) images.push_back(image);
  }
  if (images.size() == of_session) return solution;
  std::optional<Solution> by_all = solve(images, min_inliers);
  if (!by_all || (solution && solution->holds && !by_all->holds)) return solution;
  if (solution) by_all->trial = solution->trial;
  return by_all;
}

std::optional<PoseVerifier::Solution> PoseVerifier::solve(const std::vector<std::size_t>& images,
                                                          std::size_t min_inliers) {
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
  const auto solved = solvePose(sights, kTolerance_px / focal_px_, min_inliers, moving_.sum());
  if (!solved) return std::nullopt;
  std::vector<Pair> inliers;
  for (const std::size_t i : solved->inliers) inliers.push_back(seen[i]);
  Solution solution;
  addMatched(images, std::move(inliers), solution);
  MetricPose& pose = solution.pose;
  pose.camera = solved->camera;
  pose.base = mount_.baseInMap(pose.camera);
  pose.covariance = config_.sigma_factor * config_.sigma_factor * atBase(solved->covariance, pose);
  pose.inliers = solved->agreeing;
  pose.reprojection_px = solved->median_error * focal_px_;
  // Of the image whose landmarks made it: the nearest one may be of a stretch that is better known.
  const auto geometry = map_.geometry(solution.matched.training_image);
  if (geometry) pose.map_covariance = atBase(geometry->covariance, pose);
  solution.moving_gain = solved->moving_gain;
  solution.focal_scale = solved->focal_scale;
  solution.focal_sigma = solved->focal_sigma;
  solution.holds =
      pose.sigma_m() <= config_.max_sigma_m && !focal_.wouldContradict(solution.focal_scale, solution.focal_sigma);
  return solution;
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
  const std::shared_ptr<const LocalFeatures> features = map_.local(training_image);
  if (!indices_.empty() && indices_.back() >= features->size()) return;  // they could not be read
  features->subset(indices_, landmarks_);
  map_.header().kind->correspond(*features_, landmarks_, kMatchRatio, found_);
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

void PoseVerifier::addMatched(const std::vector<std::size_t>& training_images, std::vector<Pair> inliers,
                              Solution& solution) {
  std::sort(inliers.begin(), inliers.end());
  std::size_t most = 0;
  for (const std::size_t image : training_images) {
    MatchedLandmarks matched{image, {}};
    std::size_t agreeing = 0;
    for (const Match& match : matchesWith(image)) {
      const Keypoint& keypoint = features_->keypoints()[match.feature];
      const bool inlier = std::binary_search(inliers.begin(), inliers.end(), Pair(match.landmark, match.feature));
      matched.landmarks.push_back({{keypoint.x_px, keypoint.y_px}, match.training_feature, inlier});
      agreeing += inlier ? 1 : 0;
    }
    solution.agreeing.push_back(agreeing);
    if (agreeing <= most) continue;
    most = agreeing;
    solution.matched = std::move(matched);
  }
}

/// Of this pose and of those before it that it follows.
std::size_t PoseVerifier::inliersTogether(const MetricPose& pose) const {
  return (predictor_.follows(pose) ? inliers_together_ : 0) + pose.inliers;
}

/// Whether enough landmarks agree for TRACKING.
bool PoseVerifier::isClear(const MetricPose& pose) const {
  return inliersTogether(pose) >= static_cast<std::size_t>(config_.min_inliers_tracking);
}

/// What landmarks say about plants and sessions counts even where their pose does not; about the calibration, in the
/// map alone.
std::optional<MetricPose> PoseVerifier::commit(const Solution& solution, bool accepted) {
  if (mapped_ || accepted) focal_.add(solution.focal_scale, solution.focal_sigma);
  moving_gain_ = solution.moving_gain;
  if (const auto& trial = solution.trial) {
    sessions_.learn(trial->training_image, trial->inliers, trial->tried_image, trial->tried_inliers);
  }
  if (!accepted || predictor_.isBesidePrediction(solution.pose)) return std::nullopt;
  MetricPose pose = solution.pose;
  const bool clear = isClear(pose);
  inliers_together_ = inliersTogether(pose);
  pose.confirmed = predictor_.add(pose) && focal_.confirms() && clear;
  matched_ = solution.matched;
  return pose;
}

}  // namespace visual_localization

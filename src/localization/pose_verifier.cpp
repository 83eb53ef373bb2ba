#include "localization/pose_verifier.h"

#include <algorithm>
#include <cmath>

#include "base/angles.h"
#include "base/time.h"

namespace visual_localization {
namespace {

constexpr std::size_t kNeighbours = 32;  ///< looked at for those that face alike
constexpr std::size_t kHypotheses = 2;   ///< of positions that look alike
constexpr double kTurn = 0.5;            ///< how far off the straight way a robot may be, as a share of the way
constexpr double kApart_m = 5.0;         ///< training images closer than this belong to one hypothesis

Eigen::Matrix3d covarianceOf(const SeenLandmark& landmark) {
  const Eigen::Vector3d ray = landmark.offset_m.cast<double>().normalized();
  const double along = landmark.sigma_along_m;
  const double across = landmark.sigma_across_m;
  return across * across * Eigen::Matrix3d::Identity() + (along * along - across * across) * ray * ray.transpose();
}

}  // namespace

std::optional<MetricPose> PoseVerifier::verify(std::int64_t stamp_ns, QueryImage& image, Scores& scores,
                                               const CameraModel& camera) {
  ++images_since_;
  rays_ = {};
  std::optional<MetricPose> pose = nearPrediction(stamp_ns, image, scores, camera);
  if (!pose) pose = amongMostSimilar(image, scores, camera);
  if (!pose) return std::nullopt;
  pose->confirmed = pose->inliers >= 2 * static_cast<std::size_t>(config_.min_inliers) || isNear(*pose, stamp_ns);
  remember(stamp_ns, *pose);
  return pose;
}

std::optional<PredictedPose> PoseVerifier::predicted(std::int64_t stamp_ns) const {
  if (!last_) return std::nullopt;
  const double elapsed_s = secondsBetween(last_->stamp_ns, stamp_ns);
  if (!(elapsed_s >= 0.0 && elapsed_s <= config_.max_gap_s)) return std::nullopt;
  const Eigen::Vector2d way_m = last_->velocity_mps.value_or(Eigen::Vector2d::Zero()) * elapsed_s;
  return PredictedPose{last_->position_m + way_m, last_->yaw_rad, kTurn * way_m.norm()};
}

bool PoseVerifier::isNear(const MetricPose& pose, std::int64_t stamp_ns) const {
  const std::optional<PredictedPose> expected = predicted(stamp_ns);
  return expected && (pose.camera.position_m.head<2>() - expected->position_m).norm() <=
                         config_.max_prediction_error_m + expected->sigma_m;
}

std::optional<MetricPose> PoseVerifier::nearPrediction(std::int64_t stamp_ns, QueryImage& image, Scores& scores,
                                                       const CameraModel& camera) {
  const std::optional<PredictedPose> expected = predicted(stamp_ns);
  if (!expected) return std::nullopt;
  const auto few = static_cast<std::size_t>(std::min(config_.min_inliers, config_.min_inliers_predicted));
  const auto pose = solve(around(expected->position_m, expected->yaw_rad), few, image, scores, camera);
  if (!pose || pose->inliers >= static_cast<std::size_t>(config_.min_inliers)) return pose;
  return isNear(*pose, stamp_ns) ? pose : std::nullopt;
}

std::optional<MetricPose> PoseVerifier::amongMostSimilar(QueryImage& image, Scores& scores, const CameraModel& camera) {
  std::vector<Eigen::Vector2d> tried;
  for (const std::size_t best : scores.mostSimilar()) {
    const Eigen::Vector2d& position_m = map_.position_m(best);
    if (std::any_of(tried.begin(), tried.end(),
                    [&](const Eigen::Vector2d& other) { return (other - position_m).norm() < kApart_m; })) {
      continue;
    }
    tried.push_back(position_m);
    const auto pose = solve(around(position_m, map_.yaw_rad(best)), static_cast<std::size_t>(config_.min_inliers),
                            image, scores, camera);
    if (pose || tried.size() == kHypotheses) return pose;
  }
  return std::nullopt;
}

std::vector<std::size_t> PoseVerifier::around(const Eigen::Vector2d& position_m, double yaw_rad) {
  map_.nearest(position_m, kNeighbours, neighbours_);
  std::vector<std::size_t> chosen;
  for (const Neighbour& neighbour : neighbours_) {
    if (chosen.size() == static_cast<std::size_t>(config_.training_images)) break;
    if (faceAlike(map_.yaw_rad(neighbour.image), yaw_rad)) chosen.push_back(neighbour.image);
  }
  return chosen;
}

std::optional<MetricPose> PoseVerifier::solve(const std::vector<std::size_t>& training_images, std::size_t min_inliers,
                                              QueryImage& image, Scores& scores, const CameraModel& camera) {
  matches_.clear();
  seen_.clear();
  if (rays_.sigmas.empty()) {
    live_ = image.unprunedSift();
    if (live_ == nullptr) return std::nullopt;
    rays_ = raysOf(*live_, camera, config_.keypoint_sigma_px);
  }
  for (const std::size_t training_image : training_images) addMatches(training_image, scores);
  const double focal_px = camera.intrinsics().fx;
  const auto solved = solvePose(matches_, config_.tolerance_px / focal_px, min_inliers);
  if (!solved) return std::nullopt;
  MetricPose pose;
  pose.camera = solved->camera;
  pose.covariance = solved->covariance;
  pose.inliers = solved->inliers.size();
  pose.reprojection_px = solved->median_error * focal_px;
  pose.map_covariance = map_.geometry(training_images.front()) ? map_.geometry(training_images.front())->covariance
                                                               : MetricPose::Covariance::Zero();
  return pose.sigma_m() <= config_.max_sigma_m ? std::optional<MetricPose>(pose) : std::nullopt;
}

void PoseVerifier::addMatches(std::size_t training_image, Scores& scores) {
  const std::shared_ptr<const ImageGeometry> geometry = map_.geometry(training_image);
  if (!geometry) return;
  scores.count(training_image);
  indices_.clear();
  for (const SeenLandmark& landmark : geometry->landmarks) indices_.push_back(landmark.feature);
  const std::shared_ptr<const SiftFeatures> features = map_.sift(training_image);
  if (!indices_.empty() && indices_.back() >= features->size()) return;  // they could not be read
  features->subset(indices_, landmarks_);
  matchSymmetric(*live_, landmarks_, config_.match_ratio, found_);
  for (const FeatureMatch& match : found_) {
    if (!rays_.normalised[match.a].allFinite()) continue;
    const SeenLandmark& landmark = geometry->landmarks[match.b];
    const std::pair<std::uint32_t, std::size_t> pair(landmark.id, match.a);
    if (std::find(seen_.begin(), seen_.end(), pair) != seen_.end()) continue;
    seen_.push_back(pair);
    matches_.push_back({rays_.normalised[match.a], rays_.sigmas[match.a],
                        geometry->camera.position_m + landmark.offset_m.cast<double>(), covarianceOf(landmark)});
  }
}

void PoseVerifier::remember(std::int64_t stamp_ns, const MetricPose& pose) {
  Known known{stamp_ns, pose.camera.position_m.head<2>(), pose.camera.yaw_rad(), {}};
  if (last_) {
    const double elapsed_s = secondsBetween(last_->stamp_ns, stamp_ns);
    if (elapsed_s > 0.0 && elapsed_s <= config_.max_gap_s) {
      known.velocity_mps = (known.position_m - last_->position_m) / elapsed_s;
    }
  }
  last_ = known;
  images_since_ = 0;
}

}  // namespace visual_localization

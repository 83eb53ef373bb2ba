#include "geometry/session_geometry.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>

#include "base/parallel.h"
#include "base/statistics.h"
#include "geometry/bundle_adjustment.h"
#include "geometry/feature_tracks.h"
#include "geometry/fix_positions.h"
#include "geometry/keypoint_rays.h"
#include "geometry/rotation_averaging.h"
#include "geometry/triangulation.h"
#include "geometry/two_view.h"

namespace visual_localization {
namespace {

constexpr double kMaxTurn_rad = 0.6;        ///< from one image to the next
constexpr std::uint32_t kRotationSpan = 3;  ///< images farther apart say little about each other's rotation
constexpr std::size_t kMinViews = 3;        ///< of a landmark
constexpr double kMinAngle_rad = 0.01;      ///< between two rays to a landmark
constexpr double kFar_m = 3.0;              ///< an image moved by more than this is far from the cleaned path
constexpr double kMostFar = 0.05;           ///< share of such images in a session to be believed
constexpr double kFocalTolerance = 0.01;
constexpr double kBelievedFix_m = 1.0;  ///< from the cleaned path: what the first adjustment takes
/// Relative changes of the cost at which adjustments end. The whole path turns and shifts along a flat valley of the
/// cost: thousands of sightings hardly feel it. With 100 times as much it stops on the way, metres off where the camera
/// looks aside or the road climbs.
constexpr double kCoarse = 1e-5;
constexpr double kFine = 1e-6;

/// Two images of the session, and what they agree on.
struct Pair {
  ImagePair matches;
  std::optional<TwoView> view;
};

class SessionAdjuster {
 public:
  SessionAdjuster(const UnadjustedSession& session, const GeometryConfig& config, std::size_t threads)
      : session_(session), config_(config), threads_(threads) {
    bundle_.position_loss = config.fix_loss;
  }

  SessionGeometry run(std::uint32_t first_id) {
    for (std::size_t i = 0; i < session_.images.size(); ++i) {
      rays_.push_back(raysOf(*session_.features(i), *session_.camera, config_.keypoint_sigma_px));
    }
    matchPairs();
    startProblem();
    adjustAll();
    return result(first_id);
  }

 private:
  void matchPairs() {
    const auto count = static_cast<std::uint32_t>(rays_.size());
    const auto span = static_cast<std::uint32_t>(config_.pair_span);
    for (std::uint32_t a = 0; a < count; ++a) {
      for (std::uint32_t b = a + 1; b < count && b <= a + span; ++b) pairs_.push_back({{a, b, {}}, {}});
    }
    parallelFor(pairs_.size(), threads_, [this](std::size_t i) { verify(pairs_[i]); });
    pairs_.erase(std::remove_if(pairs_.begin(), pairs_.end(), [](const Pair& pair) { return !pair.view; }),
                 pairs_.end());
  }

  void verify(Pair& pair) const {
    const auto [a, b] = std::pair(pair.matches.a, pair.matches.b);
    const auto matches = matchSymmetric(*session_.features(a), *session_.features(b), config_.match_ratio);
    pair.view = verifyTwoViews(rays_[a].normalised, rays_[b].normalised, usable(matches, rays_[a], rays_[b]),
                               config_.epipolar_tolerance_px / focal_px(),
                               static_cast<std::size_t>(config_.min_pair_inliers), kMaxTurn_rad * (b - a));
    if (pair.view) pair.matches.matches = pair.view->inliers;
  }

  void startProblem() {
    std::vector<double> yaws_rad;
    for (const TrajectoryPoint& image : session_.images) yaws_rad.push_back(image.yaw_rad);
    std::vector<RelativeRotation> relative;
    std::vector<ImagePair> matches;
    std::vector<std::size_t> feature_counts;
    for (const Pair& pair : pairs_) {
      const auto& [a, b, inliers] = pair.matches;
      if (b - a <= kRotationSpan) relative.push_back({a, b, pair.view->b_from_a});
      matches.push_back(pair.matches);
    }
    for (const KeypointRays& rays : rays_) feature_counts.push_back(rays.normalised.size());
    tracks_ = tracksOf(matches, feature_counts, kMinViews);
    const AveragedRotations rotations = averageRotations(yaws_rad, relative);
    problem_.mounting_rad = rotations.mounting_rad;
    for (std::size_t i = 0; i < yaws_rad.size(); ++i) {
      const Eigen::Vector2d& position = session_.images[i].position_m;
      problem_.cameras.push_back({rotations.camera_in_map[i], {position.x(), position.y(), 0.0}});
      problem_.travel.push_back(levelCamera(yaws_rad[i]));
    }
  }

  /// Coarse positions first, so the first landmarks are off by many pixels; then again from what that came to.
  void adjustAll() {
    std::vector<PositionObservation> positions = positionsAt(session_.images, session_.fixes, config_.fix_sigma_m);
    std::vector<double> sigmas_m;
    for (PositionObservation& position : positions) {
      sigmas_m.push_back(position.sigma_m);
      position.sigma_m *= config_.fix_correlation;
    }
    fix_sigma_m_ = sigmas_m.empty() ? config_.fix_sigma_m : median(sigmas_m);
    for (const PositionObservation& position : positions) {
      const double off_m = (position.east_north_m - session_.images[position.image].position_m).norm();
      if (off_m < kBelievedFix_m) problem_.positions.push_back(position);
    }
    triangulateAll(20.0);
    adjustAndPrune(kCoarse, 2);
    problem_.positions = positions;
    for (int again = 0; again < 2; ++again) {
      triangulateAll(4.0);
      adjustAndPrune(kCoarse, 2);
    }
    adjustAndPrune(kFine, kMinViews);
    focal_scale_ = freeFocalScale();
  }

  /// What the images make of the focal length, when they may.
  double freeFocalScale() const {
    BundleProblem problem = problem_;
    BundleConfig config = bundle_;
    config.focal_is_free = true;
    config.tolerance = 1e-3;
    adjust(problem, config);
    return problem.focal_scale;
  }

  void adjustAndPrune(double tolerance, std::size_t min_views) {
    bundle_.tolerance = tolerance;
    adjust(problem_, bundle_);
    for (Landmark& landmark : problem_.landmarks) {
      auto& all = landmark.sightings;
      const auto disagrees = [&](const LandmarkSighting& sighting) {
        return !(error(landmark, sighting) <= config_.max_residual_sigmas * sighting.sigma);
      };
      all.erase(std::remove_if(all.begin(), all.end(), disagrees), all.end());
    }
    auto& all = problem_.landmarks;
    const auto lost = [&](const Landmark& landmark) {
      return landmark.sightings.size() < min_views || !landmark.position_m.allFinite();
    };
    all.erase(std::remove_if(all.begin(), all.end(), lost), all.end());
  }

  void triangulateAll(double gate_px) {
    problem_.landmarks.clear();
    for (const FeatureTrack& track : tracks_) {
      Landmark landmark;
      std::vector<Sight> sights;
      for (const FeatureObservation& seen : track) {
        const KeypointRays& rays = rays_[seen.image];
        sights.push_back({&problem_.cameras[seen.image], rays.normalised[seen.feature]});
        landmark.sightings.push_back({seen.image, seen.feature, sights.back().normalised, rays.sigmas[seen.feature]});
      }
      const std::optional<Eigen::Vector3d> point = triangulate(sights, kMinAngle_rad);
      if (!point) continue;
      landmark.position_m = *point;
      auto& all = landmark.sightings;
      const auto is_off = [&](const LandmarkSighting& sighting) {
        return !(error(landmark, sighting) * focal_px() <= gate_px);
      };
      all.erase(std::remove_if(all.begin(), all.end(), is_off), all.end());
      if (all.size() >= 2) problem_.landmarks.push_back(std::move(landmark));
    }
  }

  /// Of a sighting, in normalised coordinates.
  double error(const Landmark& landmark, const LandmarkSighting& sighting) const {
    return reprojectionError(problem_.cameras[sighting.image], landmark.position_m, sighting.normalised);
  }

  SessionGeometry result(std::uint32_t first_id) const {
    SessionGeometry geometry;
    std::vector<ImageGeometry> images(problem_.cameras.size());
    std::vector<double> errors_px;
    for (std::size_t i = 0; i < images.size(); ++i) images[i] = imageAt(i);
    for (std::size_t i = 0; i < problem_.landmarks.size(); ++i) {
      const Landmark& landmark = problem_.landmarks[i];
      const Eigen::Matrix3d covariance = covarianceOf(landmark);
      for (const LandmarkSighting& sighting : landmark.sightings) {
        errors_px.push_back(error(landmark, sighting) * focal_px());
        addLandmark(images[sighting.image], landmark, covariance, sighting.feature,
                    first_id + static_cast<std::uint32_t>(i));
      }
    }
    geometry.landmarks = problem_.landmarks.size();
    geometry.sightings = errors_px.size();
    geometry.median_error_px = median(errors_px);
    geometry.mounting_rad = problem_.mounting_rad;
    geometry.focal_scale = focal_scale_;
    keep(std::move(images), geometry);
    geometry.contradicts_calibration = !isBelievable(geometry);
    return geometry;
  }

  ImageGeometry imageAt(std::size_t i) const {
    ImageGeometry image;
    image.camera = problem_.cameras[i];
    Eigen::Matrix<double, 6, 1> sigmas;
    const double bias_m = std::max(config_.fix_bias * fix_sigma_m_, 0.01);
    sigmas << bias_m, bias_m, bias_m, 0.004, 0.004, 0.004;
    image.covariance = sigmas.cwiseAbs2().asDiagonal();
    return image;
  }

  /// Of a landmark among cameras that stand still.
  Eigen::Matrix3d covarianceOf(const Landmark& landmark) const {
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    for (const LandmarkSighting& sighting : landmark.sightings) {
      const CameraPose& camera = problem_.cameras[sighting.image];
      const Eigen::Vector3d point = camera.toCamera(landmark.position_m);
      Eigen::Matrix<double, 2, 3> by_point;
      by_point << 1.0, 0.0, -point.x() / point.z(), 0.0, 1.0, -point.y() / point.z();
      by_point *= 1.0 / (point.z() * sighting.sigma);
      const Eigen::Matrix<double, 2, 3> by_landmark = by_point * camera.rotation.conjugate().toRotationMatrix();
      information += by_landmark.transpose() * by_landmark;
    }
    return information.ldlt().solve(Eigen::Matrix3d::Identity());
  }

  static void addLandmark(ImageGeometry& image, const Landmark& landmark, const Eigen::Matrix3d& covariance,
                          std::uint32_t feature, std::uint32_t id) {
    const Eigen::Vector3d offset = landmark.position_m - image.camera.position_m;
    const Eigen::Vector3d ray = offset.normalized();
    const double along_m2 = ray.dot(covariance * ray);
    const double across_m2 = 0.5 * (covariance.trace() - along_m2);
    if (!(std::isfinite(along_m2) && along_m2 > 0.0 && across_m2 > 0.0)) return;
    image.landmarks.push_back({feature, id, offset.cast<float>(), static_cast<float>(std::sqrt(along_m2)),
                               static_cast<float>(std::sqrt(across_m2))});
  }

  void keep(std::vector<ImageGeometry> images, SessionGeometry& geometry) const {
    for (std::size_t i = 0; i < images.size(); ++i) {
      auto& landmarks = images[i].landmarks;
      std::sort(landmarks.begin(), landmarks.end(),
                [](const SeenLandmark& a, const SeenLandmark& b) { return a.feature < b.feature; });
      const bool enough = landmarks.size() >= static_cast<std::size_t>(config_.min_landmarks);
      const double shift_m = (images[i].camera.position_m.head<2>() - session_.images[i].position_m).norm();
      geometry.images.push_back(enough ? std::optional<ImageGeometry>(std::move(images[i])) : std::nullopt);
      if (!enough) continue;
      geometry.mean_shift_m += shift_m;
      geometry.largest_shift_m = std::max(geometry.largest_shift_m, shift_m);
      if (shift_m > kFar_m) geometry.far_share += 1.0 / static_cast<double>(images.size());
    }
    const auto kept = std::count_if(geometry.images.begin(), geometry.images.end(),
                                    [](const auto& image) { return image.has_value(); });
    if (kept > 0) geometry.mean_shift_m /= static_cast<double>(kept);
  }

  /// A wrong calibration bends the path away from the fixes, or the images would rather have another one.
  bool isBelievable(const SessionGeometry& geometry) const {
    return geometry.far_share <= kMostFar && std::abs(geometry.focal_scale - 1.0) <= kFocalTolerance;
  }

  double focal_px() const { return session_.camera->intrinsics().fx; }

  const UnadjustedSession& session_;
  const GeometryConfig& config_;
  std::size_t threads_;
  BundleConfig bundle_;
  std::vector<KeypointRays> rays_;
  std::vector<Pair> pairs_;
  std::vector<FeatureTrack> tracks_;
  BundleProblem problem_;
  double focal_scale_ = 1.0;
  double fix_sigma_m_ = 0.0;  ///< of a usual fix
};

}  // namespace

SessionGeometry adjustSession(const UnadjustedSession& session, const GeometryConfig& config, std::uint32_t first_id,
                              std::size_t threads) {
  return SessionAdjuster(session, config, threads).run(first_id);
}

}  // namespace visual_localization

#include "geometry/rays.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace visual_localization {

KeypointRays raysOf(const SiftFeatures& features, const CameraModel& camera, double sigma_px) {
  constexpr double kSmall_px = 6.0;
  std::vector<Eigen::Vector2d> pixels;
  KeypointRays rays;
  for (const SiftKeypoint& keypoint : features.keypoints()) {
    pixels.emplace_back(keypoint.x_px, keypoint.y_px);
    const double growth = std::hypot(1.0, keypoint.size_px / kSmall_px);
    rays.sigmas.push_back(sigma_px * growth / camera.intrinsics().fx);
  }
  rays.normalised = camera.undistort(pixels);
  return rays;
}

std::vector<FeatureMatch> usable(const std::vector<FeatureMatch>& matches, const KeypointRays& a,
                                 const KeypointRays& b) {
  std::vector<FeatureMatch> kept;
  for (const FeatureMatch& match : matches) {
    if (a.normalised[match.a].allFinite() && b.normalised[match.b].allFinite()) kept.push_back(match);
  }
  return kept;
}

namespace {

constexpr double kNearest_m = 0.1;  ///< a point closer to a camera than this is none

Eigen::Vector3d direction(const Sight& sight) {
  return sight.camera->rotation * sight.normalised.homogeneous().normalized();
}

/// The direction farthest from `from`.
Eigen::Vector3d farthest(const Eigen::Vector3d& from, const std::vector<Sight>& sights) {
  Eigen::Vector3d found = from;
  for (const Sight& sight : sights) {
    const Eigen::Vector3d other = direction(sight);
    if (from.dot(other) < from.dot(found)) found = other;
  }
  return found;
}

/// Of rays that lie in a plane, as those from a path do, it is the widest; of others all but that.
double widestAngle_rad(const std::vector<Sight>& sights) {
  const Eigen::Vector3d one_end = farthest(direction(sights.front()), sights);
  return std::acos(std::clamp(one_end.dot(farthest(one_end, sights)), -1.0, 1.0));
}

}  // namespace

std::optional<Eigen::Vector3d> triangulate(const std::vector<Sight>& sights, double min_angle_rad) {
  if (sights.size() < 2 || widestAngle_rad(sights) < min_angle_rad) return std::nullopt;
  const Eigen::Vector3d& origin = sights.front().camera->position_m;  // keeps the sums small
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d weighted = Eigen::Vector3d::Zero();
  for (const Sight& sight : sights) {
    const Eigen::Vector3d ray = direction(sight);
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - ray * ray.transpose();
    sum += across;
    weighted += across * (sight.camera->position_m - origin);
  }
  const Eigen::Vector3d point = origin + Eigen::Vector3d(sum.ldlt().solve(weighted));
  const bool visible = point.allFinite() && std::all_of(sights.begin(), sights.end(), [&point](const Sight& sight) {
                         return sight.camera->toCamera(point).z() > kNearest_m;
                       });
  return visible ? std::optional<Eigen::Vector3d>(point) : std::nullopt;
}

}  // namespace visual_localization

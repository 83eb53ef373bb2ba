#include "geometry/keypoint_rays.h"

#include <cmath>

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

}  // namespace visual_localization

#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "visual_localization/features/sift_matcher.h"

namespace visual_localization {

/// What two images of one static scene agree on.
struct TwoView {
  Eigen::Quaterniond b_from_a = Eigen::Quaterniond::Identity();  ///< turns directions of camera a into those of b
  std::vector<FeatureMatch> inliers;                             ///< matches that lie on each other's epipolar lines
};

/// Verifies matches by the essential matrix (USAC_MAGSAC). `a`, `b`: normalised image coordinates of all features, to
/// which `matches` refer. Of the two rotations that explain the matrix the smaller is taken: with little parallax
/// the test of depths picks the twisted one. Nothing when fewer than `min_inliers` remain or the cameras turn by more
/// than `max_rotation_rad`. The result depends on the input alone.
std::optional<TwoView> verifyTwoViews(const std::vector<Eigen::Vector2d>& a, const std::vector<Eigen::Vector2d>& b,
                                      const std::vector<FeatureMatch>& matches, double tolerance,
                                      std::size_t min_inliers, double max_rotation_rad);

}  // namespace visual_localization

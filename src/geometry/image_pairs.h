#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "visual_localization/features/sift_matcher.h"
#include "visual_localization/geo/trajectory.h"

namespace visual_localization {

/// An image on the cleaned path of its session.
struct PathImage {
  std::uint32_t session = 0;
  TrajectoryPoint at;
};

/// Pairs of images, the smaller index first, that may show the same from about the same position, though they were not
/// recorded one after the other: of different sessions, or of one that comes back after a while. Each image is paired
/// with the nearest one that faces alike of each such visit, with three of them at most. Images of a session follow
/// each other.
std::vector<std::pair<std::uint32_t, std::uint32_t>> revisits(const std::vector<PathImage>& images);

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

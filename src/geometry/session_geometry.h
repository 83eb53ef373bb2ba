#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "visual_localization/camera/camera_model.h"
#include "visual_localization/features/local_feature_kind.h"
#include "visual_localization/features/sift.h"
#include "visual_localization/geo/trajectory.h"
#include "visual_localization/geometry/camera_pose.h"
#include "visual_localization/geometry/fix_budget.h"
#include "visual_localization/geometry/image_geometry.h"

namespace visual_localization {

/// When two images of a map count as a pair.
struct PairRule {
  /// Of the angles to the nearest and second nearest descriptor. Stricter than for a live image: no pose tells yet
  /// which matches are wrong.
  static constexpr double kMatchRatio = 0.75;
  /// Of a match from both epipolar lines together: 0.7 pixels from each, more than two sigmas of a small feature.
  static constexpr double kTolerance_px = 1.0;
  static constexpr std::size_t kMinInliers = 15;  ///< as COLMAP asks (min_num_inliers)
};

/// A fix in the map frame.
struct MapFix {
  std::int64_t stamp_ns = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();    ///< east, north
  double sigma_m = 0.0;                                    ///< per axis, as the receiver claims; 0: not known
  double up_m = std::numeric_limits<double>::quiet_NaN();  ///< above the datum; NaN: not known
  double sigma_up_m = 0.0;                                 ///< the same as sigma_m
  bool believed = true;                                    ///< by the cleaning of the path
};

/// A session before its adjustment.
struct UnadjustedSession {
  std::vector<TrajectoryPoint> images;  ///< where the cleaned path has the antenna, in order of time
  std::function<std::shared_ptr<const LocalFeatures>(std::size_t)> features;  ///< of an image
  std::shared_ptr<const LocalFeatureKind> kind = std::make_shared<Sift>();    ///< of these features
  const CameraModel* camera = nullptr;
  SensorMount mount;
  bool finds_mount = false;    ///< nobody knows how the camera is turned: `mount` is where to begin
  std::vector<MapFix> fixes;   ///< in order of time
  double clock_sigma_s = 0.1;  ///< how well their stamps are known to agree with those of the images
};

/// What the adjustment of a session came to, with all poses and landmarks.
struct SessionGeometry : SessionLandmarks {
  std::vector<std::optional<ImageGeometry>> images;        ///< nothing where too few landmarks are seen
  Eigen::Vector3d mounting_rad = Eigen::Vector3d::Zero();  ///< see AveragedRotations
  Intrinsics lens;                                         ///< the calibration as the images have it
  FixBudget fixes;  ///< how far off its positions may be; where sessions are tied, those of all together
};

/// Landmarks and camera poses of sessions from their images and fixes: matches of neighbouring images and of those that
/// come back to a position, verified; their rotations averaged; landmarks triangulated; all adjusted together, so that
/// the images decide which fixes lie. Sessions that overlap are tied by what both see, each with a bias of its fixes,
/// so that one position lies once. A session whose images contradict its calibration is not tied. Landmark ids are
/// unique. The result does not depend on the number of threads.
std::vector<SessionGeometry> adjustSessions(std::vector<UnadjustedSession> sessions, const GeometryConfig& config,
                                            std::size_t threads);

/// The focal length that the images of a session ask for: a pinhole with square pixels and its principal point in the
/// middle, for images of `size`. Two searches come from either side; nothing unless they end at the same focal length
/// within their sigmas, and know it as well as a calibration does (geometry/focal_sigma). The camera of `session` is
/// not looked at.
std::optional<CameraModel> calibrateByImages(UnadjustedSession session, const cv::Size& size,
                                             const GeometryConfig& config, std::size_t threads);

}  // namespace visual_localization

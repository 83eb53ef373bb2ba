#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "geometry/keypoint_rays.h"
#include "geometry/pose_solver.h"
#include "visual_localization/camera/camera_model.h"
#include "visual_localization/localization/metric_pose.h"
#include "visual_localization/localization/scores.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// A pose that no image verifies.
struct PredictedPose {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  double yaw_rad = 0.0;
  double sigma_m = 0.0;  ///< of each axis, beside that of the pose it goes on from
};

/// Solves the camera's pose from the landmarks of training images: of those near the pose that the motion so far
/// predicts, or else of those that look most alike. The solved pose is judged, not the image that it came from.
class PoseVerifier {
 public:
  /// `map` must outlive it.
  PoseVerifier(const TrainingMap& map, const MetricConfig& config) : map_(map), config_(config) {}

  void configure(const MetricConfig& config) { config_ = config; }
  /// Forgets the motion.
  void reset() { last_.reset(); }
  /// The pose of the current image; nothing when too few landmarks agree. Training images that are compared for it are
  /// counted in `scores`.
  std::optional<MetricPose> verify(std::int64_t stamp_ns, QueryImage& image, Scores& scores, const CameraModel& camera);
  /// Where the motion since the last verified pose leads to; nothing when that was longer ago than a prediction holds.
  std::optional<PredictedPose> predicted(std::int64_t stamp_ns) const;
  /// Images since the last verified one; 0 when it was the last.
  std::size_t imagesSince() const { return images_since_; }

 private:
  struct Known {
    std::int64_t stamp_ns = 0;
    Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
    double yaw_rad = 0.0;
    std::optional<Eigen::Vector2d> velocity_mps;
  };

  std::optional<MetricPose> nearPrediction(std::int64_t stamp_ns, QueryImage& image, Scores& scores,
                                           const CameraModel& camera);
  std::optional<MetricPose> amongMostSimilar(QueryImage& image, Scores& scores, const CameraModel& camera);
  std::optional<MetricPose> solve(const std::vector<std::size_t>& training_images, std::size_t min_inliers,
                                  QueryImage& image, Scores& scores, const CameraModel& camera);
  void addMatches(std::size_t training_image, Scores& scores);
  std::vector<std::size_t> around(const Eigen::Vector2d& position_m, double yaw_rad);
  bool isNear(const MetricPose& pose, std::int64_t stamp_ns) const;
  void remember(std::int64_t stamp_ns, const MetricPose& pose);

  const TrainingMap& map_;
  MetricConfig config_;
  std::optional<Known> last_;
  std::size_t images_since_ = 0;
  KeypointRays rays_;                                        ///< of the current image
  std::vector<LandmarkMatch> matches_;                       ///< of the current attempt
  std::vector<std::pair<std::uint32_t, std::size_t>> seen_;  ///< landmark and live feature of each of them
  SiftFeatures landmarks_;                                   ///< of a training image: its features that show one
  std::vector<std::size_t> indices_;
  std::vector<FeatureMatch> found_;
  const SiftFeatures* live_ = nullptr;  ///< of the current image
  std::vector<Neighbour> neighbours_;
};

}  // namespace visual_localization

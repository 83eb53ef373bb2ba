#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <opencv2/core.hpp>

#include "visual_localization/features/local_features.h"
#include "visual_localization/localization/localizer.h"

namespace visual_localization {

/// A Localizer for several threads, whose map may be missing and may be replaced.
class SharedLocalizer {
 public:
  /// A position with its uncertainty, as a person gives it.
  struct Guess {
    Eigen::Vector2d mean_m = Eigen::Vector2d::Zero();
    Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Identity();
  };

  /// Everything about one image, as a copy: publishing it does not block the localizer.
  struct Result {
    Estimate estimate;
    std::vector<Particle> particles;
    LocalFeatures local;                ///< of the image, after pruning; empty when they were not needed
    MatchConfig match;                  ///< the rule that SIFT features are matched by
    MatchedLandmarks landmarks;         ///< see Localizer::lastLandmarks
    std::optional<CameraModel> camera;  ///< see Localizer::camera
    SensorMount mount;
    Mask mask;
    std::shared_ptr<const TrainingMap> map;
  };

  explicit SharedLocalizer(const LocalizerConfig& config) : config_(config) {}

  /// From the next image on, and for later maps. Throws ParameterError when `config` is invalid, and then nothing has
  /// changed.
  void configure(const LocalizerConfig& config);

  /// Anywhere, or around the guess that has been waiting for a map.
  void setMap(std::shared_ptr<const TrainingMap> map);
  std::shared_ptr<const TrainingMap> map() const;
  /// Never waits, unlike map(), which waits for the image that is being processed.
  bool hasMap() const { return has_map_; }

  /// For this map and all later ones.
  void setCamera(const CameraModel& camera);
  /// Throws MountError.
  void setMount(const SensorMount& mount);
  void setMask(const Mask& mask);

  /// For the next image. Never waits. Throws std::invalid_argument, in words, when a number is not finite.
  void addOdometry(const OdometryReading& reading);

  /// Nothing without a map. Throws std::invalid_argument for an unusable image.
  std::optional<Result> process(std::int64_t stamp_ns, const cv::Mat& grey);

  /// Nothing without a map.
  std::optional<LocalizationState> doubt();

  /// False without a map.
  bool relocalizeAnywhere();
  /// False without a map. Throws std::invalid_argument, in words, for a disc that around() refuses, that has no area or
  /// that does not touch the map.
  bool relocalizeAround(const Eigen::Vector2d& centre_m, double radius_m);
  /// Without a map keeps the guess for the next one and returns false. Throws std::invalid_argument, in words, for a
  /// guess that normallyDistributed() refuses.
  bool relocalizeAt(const Guess& guess);

 private:
  LocalizerConfig configuration() const;
  void passOdometry();

  mutable std::mutex mutex_;
  LocalizerConfig config_;
  std::optional<CameraModel> camera_;  ///< if somebody has said
  std::optional<SensorMount> mount_;
  Mask mask_;  ///< the same; otherwise empty
  std::shared_ptr<const TrainingMap> map_;
  std::unique_ptr<Localizer> localizer_;
  std::optional<Prior> waiting_prior_;
  std::mutex odometry_mutex_;             ///< held for moments only
  std::deque<OdometryReading> odometry_;  ///< that the localizer has not seen yet
  std::atomic<bool> has_map_{false};
};

/// Position and its covariance; the training images give the heading. Throws std::invalid_argument, in words, when the
/// frame is not `global_frame` or a number is not finite.
SharedLocalizer::Guess guessFrom(const geometry_msgs::PoseWithCovarianceStamped& pose, const std::string& global_frame);

}  // namespace visual_localization

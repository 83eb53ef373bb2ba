#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "geometry/pose_solver.h"
#include "geometry/rays.h"
#include "localization/pose_predictor.h"
#include "localization/session_choice.h"
#include "visual_localization/camera/camera_model.h"
#include "visual_localization/geometry/camera_pose.h"
#include "visual_localization/localization/metric_pose.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// Whether the calibration of a live camera is right: each image whose pose is solved from landmarks also says which
/// focal length it would rather have. A wrong one bends poses by decimetres before it prevents them.
class FocalCheck {
 public:
  /// `max_error`: of the focal length, as a share of the calibration's.
  explicit FocalCheck(double max_error) : max_error_(max_error) {}

  void configure(double max_error) { max_error_ = max_error; }
  void reset() {
    images_.clear();
    added_ = false;
  }
  /// The next image.
  void startImage() { added_ = false; }
  /// What the image says: the focal length as a share of the calibration's, and its standard deviation. Replaces what
  /// was added before for the same image.
  void add(double scale, double sigma);

  /// The last images agree with the calibration, and are sure of it.
  bool confirms() const;
  /// They do not agree with it.
  bool contradicts() const;
  /// The same if this were added.
  bool wouldContradict(double scale, double sigma) const;
  /// Mean of the last images, weighted; 1 without any.
  double scale() const;

 private:
  struct Image {
    double scale;
    double weight;
  };

  double sigma() const;

  double max_error_;
  std::vector<Image> images_;  ///< the last ones
  bool added_ = false;         ///< the last of them is the current image
};

/// Whether plants stand elsewhere than on the day of the map, by all images of a drive: one image may agree with a
/// rigid scene to the pixel by chance, and with a wrong pose. A cumulative sum (Page 1954) of what each image tells:
/// one that passes by a car tells little, and a few of houses undo what many of plants told.
class MotionEvidence {
 public:
  static constexpr double kMost = 30.0;
  static constexpr double kMostOfOne = 6.0;

  /// `gain`: SolvedPose::moving_gain of an image.
  void add(double gain);
  /// At least 0; for solvePose().
  double sum() const { return sum_; }

 private:
  double sum_ = 0.0;
};

/// Whether landmarks verify no pose because the robot is not in the map. How often they verify none in the map is
/// learnt from the drive: hardly ever in the light of the map, at night often.
class MissingPoses {
 public:
  /// An image with a pose or without. `in_map`: how likely the robot is where it seems, by all that is known.
  void add(bool has_pose, double in_map);
  /// How likely the next image and those before it, in a row without a pose, are in the map: elsewhere none has one.
  double likelihood() const;
  /// The robot may be anywhere.
  void restart() { in_a_row_ = 0; }

 private:
  double missed_ = 10.0;  ///< images of the map without a pose; the first ones before anything is known
  double seen_ = 0.0;     ///< and with one
  std::size_t in_a_row_ = 0;
};

/// Solves the camera's pose from the landmarks of training images: of those near the pose that the motion so far
/// predicts, or else of those that look most alike. The solved pose is judged, not the image that it came from.
class PoseVerifier {
 public:
  /// Largest ratio of a match: looser than between images, since the pose tells which matches are wrong.
  static constexpr double kMatchRatio = 0.85;
  /// Of an inlier: ten sigmas of a keypoint, since landmarks err as well.
  static constexpr double kTolerance_px = 3.0;

  /// `map` and `sessions`, which is told how well its sessions match, must outlive it.
  PoseVerifier(const TrainingMap& map, const MetricConfig& config, SessionChoice& sessions)
      : map_(map), config_(config), sessions_(sessions), focal_(config.max_focal_error), predictor_(config) {}

  void configure(const MetricConfig& config);
  /// The robot may be anywhere: forgets the last verified pose.
  void reset();
  /// Another camera, or another calibration of it.
  void resetCamera() { focal_.reset(); }
  /// The next image. Its features, not pruned, must live until the one after it.
  /// `mount`: where the robot carries the camera. `mapped`: whether the robot may be in the map; elsewhere only the
  /// landmarks of an accepted pose say anything about the calibration.
  void startImage(std::int64_t stamp_ns, const LocalFeatures& features, const CameraModel& camera,
                  const SensorMount& mount = {}, bool mapped = true);

  /// The pose of the image if it is where the motion leads; nothing when too few landmarks agree there.
  std::optional<MetricPose> nearPrediction();
  /// The same near the first of `training_images` that verifies a pose; the most similar come first.
  std::optional<MetricPose> nearOneOf(const std::vector<std::size_t>& training_images);
  /// Where the motion since the last verified pose leads to.
  PosePredictor& predictor() { return predictor_; }
  /// Training images whose landmarks were matched with the image, each once.
  std::vector<std::size_t> compared() const;
  /// What the last verified pose rests on: of the training image that shares most inliers with it.
  const MatchedLandmarks& matched() const { return matched_; }
  /// What the last images say about the calibration. While they contradict it no pose is verified.
  const FocalCheck& focal() const { return focal_; }
  MissingPoses& missing() { return missing_; }

 private:
  /// A landmark and the feature of the image that seems to show it.
  struct Match {
    std::uint32_t landmark = 0;
    std::size_t feature = 0;
    std::uint32_t training_feature = 0;
    LandmarkMatch sight;
  };
  struct Compared {
    std::size_t training_image = 0;
    std::vector<Match> matches;
  };
  using Pair = std::pair<std::uint32_t, std::size_t>;  ///< a landmark and a feature of the image
  /// How many inliers a training image shows and one of the session that is being tried.
  struct Trial {
    std::size_t training_image = 0;
    double inliers = 0.0;
    std::size_t tried_image = 0;
    double tried_inliers = 0.0;
  };
  /// A pose that landmarks make, and what else they say. Nothing of it counts before commit().
  struct Solution {
    MetricPose pose;
    MatchedLandmarks matched;           ///< with the training image that shares most inliers
    std::vector<std::size_t> agreeing;  ///< inliers that each training image shows
    double moving_gain = 0.0;
    double focal_scale = 1.0;
    double focal_sigma = 0.0;
    bool holds = false;  ///< the pose is sure, and by a calibration that the images do not contradict
    std::optional<Trial> trial;
  };

  std::optional<Solution> solve(const std::vector<std::size_t>& training_images, std::size_t min_inliers);
  std::optional<Solution> solveAround(const Eigen::Vector2d& position_m, double yaw_rad,
                                      std::vector<std::size_t> training_images, std::size_t min_inliers,
                                      std::optional<std::size_t> trial = {});
  const std::vector<Match>& matchesWith(std::size_t training_image);
  void match(std::size_t training_image, const ImageGeometry& geometry, std::vector<Match>& matches);
  void addMatched(const std::vector<std::size_t>& training_images, std::vector<Pair> inliers, Solution& solution);
  std::optional<MetricPose> near(const std::optional<PredictedPose>& prediction);
  std::size_t inliersTogether(const MetricPose& pose) const;
  bool isClear(const MetricPose& pose) const;
  std::optional<MetricPose> commit(const Solution& solution, bool accepted);

  const TrainingMap& map_;
  MetricConfig config_;
  SessionChoice& sessions_;
  FocalCheck focal_;
  PosePredictor predictor_;
  MissingPoses missing_;
  MotionEvidence moving_;             ///< of the images before
  double moving_gain_ = 0.0;          ///< of the image
  std::size_t inliers_together_ = 0;  ///< of verified poses that follow each other
  const LocalFeatures* features_ = nullptr;
  KeypointRays rays_;  ///< of the features
  double focal_px_ = 0.0;
  SensorMount mount_;
  bool mapped_ = true;
  std::vector<Compared> compared_;
  MatchedLandmarks matched_;
  LocalFeatures landmarks_;  ///< of a training image: its features that show one
  std::vector<std::size_t> indices_;
  std::vector<FeatureMatch> found_;
};

}  // namespace visual_localization

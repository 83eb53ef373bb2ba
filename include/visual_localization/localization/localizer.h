#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "visual_localization/camera/camera_model.h"
#include "visual_localization/camera/mask.h"
#include "visual_localization/localization/estimate.h"
#include "visual_localization/localization/feature_choice.h"
#include "visual_localization/localization/localizer_config.h"
#include "visual_localization/localization/odometry.h"
#include "visual_localization/localization/query_image.h"
#include "visual_localization/localization/scores.h"
#include "visual_localization/localization/state.h"
#include "visual_localization/localization/tracker.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

class ImageLikelihood;
class PlaceFilter;
class PoseVerifier;
class SessionChoice;
struct PredictedPose;

/// One image in, one estimate out: the whole method. The nodelet, the offline programs and the experiments all
/// run through this class. Not thread-safe.
class Localizer {
 public:
  /// Starts with an unknown position. Throws ParameterError when `config` is invalid.
  Localizer(std::shared_ptr<const TrainingMap> map, const LocalizerConfig& config);
  /// The same for images that are not live: `image` knows by itself how each compares with the map.
  Localizer(std::shared_ptr<const TrainingMap> map, const LocalizerConfig& config, std::shared_ptr<QueryImage> image);
  ~Localizer();

  /// `grey`: 8-bit, one channel, at least 16 x 16; resized to the map's size. Throws std::invalid_argument for
  /// anything else, and then nothing has changed. An image that repeats the one before to the last bit is no new
  /// evidence: it gets the same answer, unless the localizer was told something meanwhile. After some of them in a row
  /// (state/frozen_images, over StateConfig::frozen_time_s) the camera counts as frozen, and the position must be
  /// confirmed anew. With state/frozen_images 0 a repeated image with another stamp is an image like any other.
  Estimate process(std::int64_t stamp_ns, const cv::Mat& grey);

  /// A reading of odometry, which may help from the next image on; see OdometryTrack::add. Without any the localizer
  /// does without, as in the papers.
  void addOdometry(const OdometryReading& reading) { odometry_.add(reading); }

  /// Goes on with other parameters from the next image on, without losing the track: another tracker, or another number
  /// of particles, begins with particles drawn from the present ones; the rest keeps all it knows. The seed holds for
  /// trackers that are made from now on. Throws ParameterError when `config` is invalid, and then nothing has changed.
  void configure(const LocalizerConfig& config);
  /// The calibration of the camera that images come from, from the next image on; resized like them to the map's size.
  /// Until then that of the map's first session, if it has one.
  void setCamera(const CameraModel& camera);
  /// For images of the map's size; nothing when neither the map nor anybody else knows it.
  const std::optional<CameraModel>& camera() const { return camera_; }
  /// Where the robot carries the camera, from the next image on: metric poses are those of the robot. Until then as in
  /// the map's first session. Throws MountError, and then nothing has changed.
  void setMount(const SensorMount& mount);
  const SensorMount& mount() const { return mount_; }
  /// Features under it are not used, from the next image on. Until then that of the map's first session. Throws
  /// CameraError when nothing is left of it at the map's size.
  void setMask(const Mask& mask);
  const Mask& mask() const { return mask_; }

  /// The position is unknown: anywhere in the map.
  void relocalize();
  /// The position is unknown within a prior (see particles.h).
  void relocalize(const Prior& prior);

  /// Nothing was seen for long: the particles stay, but the position must be confirmed anew. The state until then.
  LocalizationState doubt();

  const TrainingMap& map() const { return *map_; }
  const std::vector<Particle>& particles() const { return tracker_->particles(); }
  /// Local features of the last image after pruning, for drawing its matches; empty when there was no need for them.
  LocalFeatures lastLocal() const { return image_->local() == nullptr ? LocalFeatures() : *image_->local(); }
  /// What the last image's metric pose rests on: landmarks of the training image that shares most inliers with it, for
  /// drawing them; none without a metric pose.
  MatchedLandmarks lastLandmarks() const;

 private:
  /// How often the last image has come, to the last bit.
  struct Repeats {
    std::size_t images = 0;        ///< in a row, beyond the first
    std::size_t at_one_stamp = 0;  ///< of these, the last ones whose stamp did not change either
    std::int64_t first_ns = 0;
    std::int64_t last_ns = 0;

    void add(std::int64_t stamp_ns, bool repeated);
    double seconds() const;
  };

  FrontEndConfig frontEndConfig() const;
  bool isRepetition(std::int64_t stamp_ns) const;
  Estimate estimateOf(std::int64_t stamp_ns, const TrackerEstimate& tracked, const std::optional<MetricPose>& metric,
                      const Evidence& evidence, LocalizationState state);
  Estimate lastAgain(std::int64_t stamp_ns, double elapsed_ms);
  Estimate answer(double elapsed_ms);
  bool isFrozen() const;
  bool isStale() const;
  Evidence verify(const TrackerEstimate& tracked, const std::optional<MetricPose>& metric,
                  const std::optional<PredictedPose>& predicted);
  std::optional<PredictedPose> verifiedMotion(const TrackerEstimate& tracked);
  bool isMetric() const;
  std::optional<MetricPose> poseNearPrediction(std::int64_t stamp_ns);
  std::optional<MetricPose> poseNearProposal(const TrackerEstimate& tracked);
  TrackerEstimate track(std::int64_t stamp_ns, const std::optional<MetricPose>& metric);
  TrackerEstimate trackImage();
  TrackerEstimate trackVerified(const MetricPose& metric);
  void witness(const Motion& motion, const std::optional<MetricPose>& metric);
  std::optional<double> probabilityOf(const TrackerEstimate& tracked, const Eigen::Vector2d& position_m) const;
  const PlaceFilter& posterior() const;
  double placeVariance_m2(std::size_t image) const;
  double claimedSigma_m(const TrackerEstimate& tracked, const std::optional<MetricPose>& metric,
                        const std::optional<PredictedPose>& predicted) const;
  double hereRadius_m(std::size_t image) const;
  void missPose(bool has_pose, bool is_predicted, double& probability);
  bool isThroughOtherLens(std::size_t training_image) const;
  void learnSession(const TrackerEstimate& tracked);
  void bringTracker(const TrackerEstimate& tracked, const MetricPose& metric);
  void choosePose(Estimate& estimate, const std::optional<PredictedPose>& predicted);
  void explainLast(const std::optional<PredictedPose>& predicted, bool is_late);
  bool isTurned(const PredictedPose& predicted);
  PoseEstimate poseOf(const MetricPose& metric) const;
  PoseEstimate poseOf(const TrackerEstimate& tracked, LocalizationState state);
  bool isRecognised(const TrackerEstimate& tracked) const;
  Eigen::Vector2d placeOf_m(const TrackerEstimate& tracked);
  void configureTracker(const std::string& tracker_before);
  void forgetEvidence();

  std::shared_ptr<const TrainingMap> map_;
  LocalizerConfig config_;
  std::optional<CameraModel> camera_;
  Mask mask_;
  SensorMount mount_;
  std::shared_ptr<QueryImage> image_;
  Scores scores_;
  MapSweep sweep_;
  std::unique_ptr<Tracker> tracker_;
  std::unique_ptr<PlaceFilter> witness_;  ///< beside a tracker that keeps no posterior of its own
  FeatureChoice choice_;
  StateAssessor assessor_;
  OdometryTrack odometry_;
  std::optional<std::int64_t> tracked_ns_;  ///< the stamp of the last image that the tracker saw
  std::unique_ptr<SessionChoice> sessions_;
  std::unique_ptr<ImageLikelihood> likelihood_;
  std::unique_ptr<PoseVerifier> verifier_;
  std::vector<Neighbour> neighbours_;          ///< of the last estimate
  std::optional<Estimate> last_;               ///< of the last image, while it would come out the same again
  std::optional<PlaceBelief::Place> left_at_;  ///< the end of the map that the robot passed since it was confirmed
  Repeats repeats_;
  double geometry_ms_ = 0.0;  ///< of the last image, without the extraction that it brought about
};

}  // namespace visual_localization

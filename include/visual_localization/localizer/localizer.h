#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "visual_localization/localizer/estimate.h"
#include "visual_localization/localizer/front_end.h"
#include "visual_localization/localizer/localizer_config.h"
#include "visual_localization/localizer/state_assessor.h"
#include "visual_localization/map/training_map.h"
#include "visual_localization/similarity/score_cache.h"
#include "visual_localization/similarity/similarity.h"
#include "visual_localization/tracking/tracker.h"

namespace visual_localization {

/// One image in, one estimate out: the whole method. The nodelet, the offline programs and the experiments all
/// run through this class. Not thread-safe.
class Localizer {
 public:
  /// Starts with an unknown position. Throws ParameterError when `config` is invalid.
  Localizer(std::shared_ptr<const TrainingMap> map, const LocalizerConfig& config);

  /// `grey`: 8-bit, one channel, at least 16 x 16; resized to the map's size. Throws std::invalid_argument for
  /// anything else, and then nothing has changed.
  Estimate process(std::int64_t stamp_ns, const cv::Mat& grey);
  /// The same for an image whose features are known already.
  Estimate process(const Observation& observation);

  /// The position is unknown: anywhere in the map.
  void relocalize();
  /// The position is unknown within a prior (see prior.h).
  void relocalize(const Prior& prior);

  const TrainingMap& map() const { return *map_; }
  const std::vector<Particle>& particles() const { return tracker_->particles(); }
  /// What the last image showed, after pruning: for drawing its matches.
  const ImageFeatures& lastFeatures() const { return last_features_; }

 private:
  PoseEstimate poseOf(const TrackerEstimate& tracked, LocalizationState state) const;
  double yawVariance(const TrackerEstimate& tracked) const;

  std::shared_ptr<const TrainingMap> map_;
  LocalizerConfig config_;
  FrontEnd front_end_;
  std::unique_ptr<Similarity> similarity_;
  ScoreCache scores_;
  std::unique_ptr<Tracker> tracker_;
  StateAssessor assessor_;
  ImageFeatures last_features_;
};

}  // namespace visual_localization

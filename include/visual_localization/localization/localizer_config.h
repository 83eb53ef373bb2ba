#pragma once

#include <string>
#include <vector>

#include "visual_localization/features/feature_matcher.h"
#include "visual_localization/features/front_end.h"
#include "visual_localization/features/sift.h"
#include "visual_localization/localization/feature_choice.h"
#include "visual_localization/localization/metric_pose.h"
#include "visual_localization/localization/odometry.h"
#include "visual_localization/localization/similarity.h"
#include "visual_localization/localization/state.h"
#include "visual_localization/localization/tracker_config.h"
#include "visual_localization/map/training_map.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// Everything a user can set about localisation. With which parameters features are extracted is not here: the map
/// says it.
struct LocalizerConfig : TrackerConfig {
  /// No position and no heading without landmarks claims a smaller standard deviation.
  static constexpr double kMinPositionStd_m = 0.5;
  static constexpr double kMinYawStd_rad = 0.1;

  LocalizerConfig() { tracker = "bayes"; }

  std::string preset;
  std::string features = "sift";
  std::string estimate = "interpolated";
  std::string model;
  int seed = 1;
  bool prune = false;
  bool choose_session = true;
  int sweep_images = 20000;
  std::string proposals = "vlad";
  MatchConfig match{MatchConfig().max_angle_ratio, "votes"};
  SimilarityConfig similarity;
  HybridConfig hybrid;
  FitnessConfig fitness;
  StateConfig state;
  MetricConfig metric;
  OdometryConfig odometry;

  void declare(ParameterVisitor& visitor);
};

/// How images are prepared for comparison with a map. Throws ParameterError when it has other local features.
FrontEndConfig frontEndConfigOf(const LocalizerConfig& config, const MapHeader& map);

/// The parameters that `given` names, completed by the preset among them, if there is one. `defaults`: values that give
/// way to it (see withPreset).
ParameterValues localizerValues(const ParameterValues& given, const ParameterValues& defaults = {});

/// Throws ParameterError, naming what differs, when the map was not built for the preset of `config`.
void requirePresetFits(const LocalizerConfig& config, const TrainingMap& map);

}  // namespace visual_localization

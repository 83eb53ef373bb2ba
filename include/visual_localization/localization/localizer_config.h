#pragma once

#include <string>

#include "visual_localization/features/front_end.h"
#include "visual_localization/features/sift_extractor.h"
#include "visual_localization/features/sift_matcher.h"
#include "visual_localization/localization/score.h"
#include "visual_localization/localization/state.h"
#include "visual_localization/localization/tracker_config.h"
#include "visual_localization/map/training_map.h"
#include "visual_localization/parameters/parameter_visitor.h"

namespace visual_localization {

/// Everything a user can set about localisation. With which parameters features are extracted is not here: the map
/// says it.
struct LocalizerConfig : TrackerConfig {
  std::string features = "sift";
  std::string sift_backend = kNativeSift;  ///< which extractor; their features can be matched with each other
  int seed = 1;                            ///< same seed, images and map: same track
  bool prune = true;                       ///< keep only features that the image before showed as well
  double max_image_gap_s = 10.0;           ///< longer pauses between images make the earlier one useless for pruning
  double min_position_std_m = 0.5;         ///< accuracy of the map's own positions: no covariance claims more
  double min_yaw_std_rad = 0.1;            ///< the camera is never mounted and driven exactly along the path
  int sweep_images = 20000;                ///< of a larger map a sweep compares at most this number per image
  MatchConfig match;
  SimilarityConfig similarity;
  HybridConfig hybrid;
  StateConfig state;

  void declare(ParameterVisitor& visitor);
};

/// How images are prepared for comparison with a map.
FrontEndConfig frontEndConfigOf(const LocalizerConfig& config, const MapHeader& map);

}  // namespace visual_localization

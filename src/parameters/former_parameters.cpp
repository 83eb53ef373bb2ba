#include "parameters/former_parameters.h"

namespace visual_localization {

const std::map<std::string, double>& formerParameters() {
  static const std::map<std::string, double> values{
      {"bayes/comparisons", 60.0},
      {"bayes/first_comparisons", 400.0},
      {"bayes/uniform", 0.03},
      {"dpso/best_particles", 5.0},
      {"dpso/corridor", 20.0},
      {"dpso/exclusion_radius", 15.0},
      {"dpso/mode_radius", 5.0},
      {"dpso/rival_share", 0.5},
      {"geometry/epipolar_tolerance", 1.0},
      {"geometry/fix_correlation", 3.3},
      {"geometry/fix_loss", 1.0},
      {"geometry/keypoint_sigma", 0.3},
      {"geometry/match_ratio", 0.75},
      {"geometry/max_residual", 5.0},
      {"geometry/min_landmarks", 12.0},
      {"geometry/min_pair_inliers", 15.0},
      {"max_image_gap", 10.0},
      {"metric/keypoint_sigma", 0.3},
      {"metric/match_ratio", 0.85},
      {"metric/max_focal_error", 0.01},
      {"metric/max_gap", 5.0},
      {"metric/max_prediction_error", 1.0},
      {"metric/max_sigma", 0.3},
      {"metric/min_inliers_predicted", 12.0},
      {"metric/sigma_factor", 1.4},
      {"metric/tolerance", 3.0},
      {"metric/training_images", 5.0},
      {"odometry/max_distance", 100.0},
      {"odometry/max_gap", 0.5},
      {"odometry/max_speed", 10.0},
      {"odometry/share", 0.5},
      {"similarity/global_exponent", 20.0},
      {"similarity/global_recognised", 0.6},
      {"similarity/votes_exponent", 2.0},
      {"similarity/votes_recognised", 0.016},
      {"state/frozen_time", 1.0},
      {"state/max_step", 10.0},
      {"state/min_features", 10.0},
      {"state/min_global_similarity", 0.65},
      {"state/min_matches", 5.0},
      {"state/sure_similarity", 0.2},
  };
  return values;
}

}  // namespace visual_localization

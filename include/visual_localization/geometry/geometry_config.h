#pragma once

#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// How landmarks and poses of a map come from its images and fixes.
struct GeometryConfig {
  bool enabled = true;
  bool self_calibration = false;
  int pair_span = 8;
  double match_ratio = 0.75;
  double epipolar_tolerance_px = 1.0;
  int min_pair_inliers = 15;
  double keypoint_sigma_px = 0.3;
  double max_residual_sigmas = 5.0;
  double fix_sigma_m = 0.3;
  double fix_correlation = 3.3;
  double fix_loss = 1.0;
  double fix_bias = 0.45;
  int window = 2000;
  int min_landmarks = 12;
  double spacing_m = 2.0;

  void declare(ParameterVisitor& visitor);
};

}  // namespace visual_localization

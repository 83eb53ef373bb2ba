#pragma once

#include <vector>

#include <Eigen/Core>

#include "visual_localization/camera/camera_model.h"
#include "visual_localization/features/sift_features.h"
#include "visual_localization/features/sift_matcher.h"

namespace visual_localization {

/// Where the features of an image are in the camera's frame, index by index.
struct KeypointRays {
  std::vector<Eigen::Vector2d> normalised;  ///< x/z, y/z; NaN where the lens has no ray
  std::vector<double> sigmas;               ///< standard deviation of each coordinate, same unit
};

/// A small feature is found to `sigma_px`, a large one, whose octave has larger pixels, less exactly.
KeypointRays raysOf(const SiftFeatures& features, const CameraModel& camera, double sigma_px);

/// The matches of which both features have a ray.
std::vector<FeatureMatch> usable(const std::vector<FeatureMatch>& matches, const KeypointRays& a,
                                 const KeypointRays& b);

}  // namespace visual_localization

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace visual_localization {

/// A landmark that was matched with a feature of an image.
struct MatchedLandmark {
  Eigen::Vector2f seen_px = Eigen::Vector2f::Zero();  ///< that feature, pixels of the map's image size
  std::uint32_t training_feature = 0;                 ///< what shows it in the training image, index of a SIFT feature
  bool inlier = false;                                ///< agrees with the pose
};

/// The landmarks of one training image that were matched with an image.
struct MatchedLandmarks {
  std::size_t training_image = 0;
  std::vector<MatchedLandmark> landmarks;
};

}  // namespace visual_localization

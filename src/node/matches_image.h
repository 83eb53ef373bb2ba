#pragma once

#include <opencv2/core.hpp>

#include "visual_localization/features/sift_features.h"
#include "visual_localization/features/sift_matcher.h"
#include "visual_localization/localization/matched_landmarks.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// The current image (left) beside training image `training` (right), with a line for each match, by the rule that the
/// localizer compares them by. `grey`: 8-bit, one channel, any size; `sift`: its features in pixels of the map's image
/// size. The map keeps only a small preview of a training image, which is enlarged; without one the right half stays
/// dark. Returns an 8-bit BGR image.
cv::Mat drawMatches(const cv::Mat& grey, const SiftFeatures& sift, const TrainingMap& map, std::size_t training,
                    const MatchConfig& match);

/// The same with the landmarks of a metric pose beside the training image that shares most of them: green those that
/// agree with the pose, red those that do not.
cv::Mat drawLandmarks(const cv::Mat& grey, const MatchedLandmarks& matched, const TrainingMap& map);

}  // namespace visual_localization

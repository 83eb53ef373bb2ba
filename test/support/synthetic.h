#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "visual_localization/features/local_features.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization::test {

/// Zeros behind the first bins.
std::vector<std::uint8_t> descriptor(const std::vector<int>& first_bins);
/// Features with these descriptors at keypoints (0, 0), (1, 0), ...
LocalFeatures featuresOf(const std::vector<std::vector<std::uint8_t>>& descriptors);
/// `count` features with random descriptors, the same for the same seed.
LocalFeatures randomFeatures(std::size_t count, std::uint32_t seed);

/// A map of images without features at these positions, heading from each to the next.
std::shared_ptr<const TrainingMap> mapAt(const std::vector<Eigen::Vector2d>& positions_m);
/// Counter-clockwise from the east.
std::vector<Eigen::Vector2d> circle(std::size_t count, double radius_m);
/// On the east axis.
std::vector<Eigen::Vector2d> street(std::size_t count, double spacing_m);

/// Random blocks, 8-bit grey: a street seen from the side.
cv::Mat wall(int width_px, int height_px, std::uint32_t seed);
/// 320 x 240 pixels from `left_px` on.
cv::Mat viewOf(const cv::Mat& wall, int left_px);

}  // namespace visual_localization::test

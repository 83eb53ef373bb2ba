#pragma once

#include <cstdint>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "visual_localization/map/training_map.h"

namespace visual_localization::test {

/// `count` features at random points of a 320 x 240 image with random descriptors; the same seed, the same ones.
inline SiftFeatures randomFeatures(std::uint32_t seed, std::size_t count) {
  std::mt19937 random(seed);
  std::vector<SiftKeypoint> keypoints(count);
  for (auto& keypoint : keypoints) {
    keypoint.x_px = static_cast<float>(random() % 320);
    keypoint.y_px = static_cast<float>(random() % 240);
  }
  std::vector<std::uint8_t> descriptors(count * SiftFeatures::kDescriptorSize);
  for (auto& byte : descriptors) byte = static_cast<std::uint8_t>(random() % 256);
  return SiftFeatures(std::move(keypoints), std::move(descriptors));
}

/// Two sessions of five images each, one per metre eastwards, the second 20 m north of the first.
inline std::shared_ptr<const TrainingMap> smallMap() {
  MapHeader header;
  header.datum = {48.5, 9.05, 340.0};
  header.image_size = {320, 240};
  header.sessions = {{"morning"}, {"evening"}};
  std::vector<TrainingImage> images;
  for (int i = 0; i < 10; ++i) {
    TrainingImage image;
    image.session = i / 5;
    image.stamp_ns = std::int64_t{1000000000} * i;
    image.position_m = {static_cast<double>(i % 5), 20.0 * image.session};
    image.sift = randomFeatures(static_cast<std::uint32_t>(i), 40);
    images.push_back(image);
  }
  return std::make_shared<const TrainingMap>(header, std::move(images));
}

}  // namespace visual_localization::test

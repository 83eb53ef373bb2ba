#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "visual_localization/features/local_features.h"
#include "visual_localization/features/sift.h"

namespace visual_localization::benchmarks {

/// `count` descriptors with the length and the skew of real ones (512 times a unit vector, many entries near zero),
/// anywhere in an image of 640 x 480 pixels.
inline LocalFeatures randomDescriptors(std::size_t count, std::uint32_t seed) {
  std::mt19937 engine(seed);
  std::exponential_distribution<double> entry(1.0);
  std::uniform_real_distribution<float> across(0.0F, 640.0F);
  std::vector<Keypoint> keypoints(count);
  for (Keypoint& keypoint : keypoints) keypoint = {across(engine), 0.75F * across(engine), 4.0F, 0.0F};
  std::vector<std::uint8_t> bytes;
  bytes.reserve(count * kSiftDimension);
  for (std::size_t i = 0; i < count; ++i) {
    std::vector<double> values(kSiftDimension);
    double squares = 0.0;
    for (double& value : values) {
      value = entry(engine);
      squares += value * value;
    }
    for (const double value : values) {
      bytes.push_back(static_cast<std::uint8_t>(std::min(255.0, std::round(512.0 * value / std::sqrt(squares)))));
    }
  }
  return LocalFeatures(std::move(keypoints), std::move(bytes));
}

/// `count` descriptors of which `shared` are those of `other` with some noise, and in the same place, as two images of
/// one place have them.
inline LocalFeatures overlappingDescriptors(const LocalFeatures& other, std::size_t count, double shared,
                                            std::uint32_t seed) {
  LocalFeatures fresh = randomDescriptors(count, seed);
  std::mt19937 engine(seed + 1);
  std::normal_distribution<double> noise(0.0, 4.0);
  std::vector<Keypoint> keypoints = fresh.keypoints().list();
  std::vector<std::uint8_t> bytes = fresh.bytes();
  const auto common = static_cast<std::size_t>(shared * static_cast<double>(std::min(count, other.size())));
  for (std::size_t i = 0; i < common; ++i) keypoints[i] = other.keypoints()[i];
  for (std::size_t i = 0; i < common * kSiftDimension; ++i) {
    bytes[i] = static_cast<std::uint8_t>(std::clamp(std::round(other.bytes()[i] + noise(engine)), 0.0, 255.0));
  }
  return LocalFeatures(std::move(keypoints), std::move(bytes));
}

}  // namespace visual_localization::benchmarks

#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "visual_localization/features/sift_features.h"

namespace visual_localization::benchmarks {

/// `count` descriptors with the length and the skew of real ones (512 times a unit vector, many entries near zero).
inline SiftFeatures randomDescriptors(std::size_t count, std::uint32_t seed) {
  std::mt19937 engine(seed);
  std::exponential_distribution<double> entry(1.0);
  std::vector<SiftKeypoint> keypoints(count);
  std::vector<std::uint8_t> bytes;
  bytes.reserve(count * SiftFeatures::kDescriptorSize);
  for (std::size_t i = 0; i < count; ++i) {
    std::vector<double> values(SiftFeatures::kDescriptorSize);
    double squares = 0.0;
    for (double& value : values) {
      value = entry(engine);
      squares += value * value;
    }
    for (const double value : values) {
      bytes.push_back(static_cast<std::uint8_t>(std::min(255.0, std::round(512.0 * value / std::sqrt(squares)))));
    }
  }
  return SiftFeatures(std::move(keypoints), std::move(bytes));
}

/// `count` descriptors of which `shared` are those of `other` with some noise, as two images of one place have them.
inline SiftFeatures overlappingDescriptors(const SiftFeatures& other, std::size_t count, double shared,
                                           std::uint32_t seed) {
  SiftFeatures fresh = randomDescriptors(count, seed);
  std::mt19937 engine(seed + 1);
  std::normal_distribution<double> noise(0.0, 4.0);
  std::vector<std::uint8_t> bytes = fresh.descriptors();
  const auto common = static_cast<std::size_t>(shared * static_cast<double>(std::min(count, other.size())));
  for (std::size_t i = 0; i < common * SiftFeatures::kDescriptorSize; ++i) {
    bytes[i] = static_cast<std::uint8_t>(std::clamp(std::round(other.descriptors()[i] + noise(engine)), 0.0, 255.0));
  }
  return SiftFeatures(fresh.keypoints(), std::move(bytes));
}

}  // namespace visual_localization::benchmarks

#include "visual_localization/features/sift_features.h"

#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>

namespace visual_localization {

SiftFeatures::SiftFeatures(std::vector<SiftKeypoint> keypoints, std::vector<std::uint8_t> descriptors) {
  swapIn(keypoints, descriptors);
}

void SiftFeatures::swapIn(std::vector<SiftKeypoint>& keypoints, std::vector<std::uint8_t>& descriptors) {
  if (descriptors.size() != keypoints.size() * kDescriptorSize) {
    throw std::invalid_argument("SIFT features: " + std::to_string(keypoints.size()) + " keypoints but " +
                                std::to_string(descriptors.size()) + " descriptor bytes");
  }
  inverse_norms_.clear();
  inverse_norms_.reserve(keypoints.size());
  keypoints_.swap(keypoints);
  descriptors_.swap(descriptors);
  for (std::size_t i = 0; i < size(); ++i) {
    const std::int32_t squared = std::inner_product(descriptor(i), descriptor(i) + kDescriptorSize, descriptor(i), 0);
    inverse_norms_.push_back(squared > 0 ? 1.0F / std::sqrt(static_cast<float>(squared)) : 0.0F);
  }
}

SiftFeatures SiftFeatures::subset(const std::vector<std::size_t>& indices) const {
  std::vector<SiftKeypoint> keypoints;
  std::vector<std::uint8_t> descriptors;
  keypoints.reserve(indices.size());
  descriptors.reserve(indices.size() * kDescriptorSize);
  for (const std::size_t i : indices) {
    keypoints.push_back(keypoints_.at(i));
    descriptors.insert(descriptors.end(), descriptor(i), descriptor(i) + kDescriptorSize);
  }
  return SiftFeatures(std::move(keypoints), std::move(descriptors));
}

}  // namespace visual_localization

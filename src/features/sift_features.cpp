#include "visual_localization/features/sift_features.h"

#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "features/image_size.h"

namespace visual_localization {

bool isExtractable(const cv::Mat& grey) {
  return grey.type() == CV_8UC1 && grey.rows >= kSmallestImageSide_px && grey.cols >= kSmallestImageSide_px &&
         !whyTooLarge(grey.size());
}

void requireExtractable(const cv::Mat& grey) {
  if (isExtractable(grey)) return;
  if (grey.type() != CV_8UC1) throw std::invalid_argument("image must be 8-bit with one channel");
  if (const auto reason = whyTooLarge(grey.size())) throw std::invalid_argument("image is too large: " + *reason);
  const std::string side = std::to_string(kSmallestImageSide_px);
  throw std::invalid_argument("image is " + std::to_string(grey.cols) + "x" + std::to_string(grey.rows) +
                              " pixels, must be at least " + side + "x" + side);
}

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
  SiftFeatures chosen;
  subset(indices, chosen);
  return chosen;
}

void SiftFeatures::subset(const std::vector<std::size_t>& indices, SiftFeatures& chosen) const {
  chosen.keypoints_.clear();
  chosen.descriptors_.clear();
  chosen.inverse_norms_.clear();
  chosen.keypoints_.reserve(indices.size());
  chosen.descriptors_.reserve(indices.size() * kDescriptorSize);
  chosen.inverse_norms_.reserve(indices.size());
  for (const std::size_t i : indices) {
    chosen.keypoints_.push_back(keypoints_.at(i));
    chosen.descriptors_.insert(chosen.descriptors_.end(), descriptor(i), descriptor(i) + kDescriptorSize);
    chosen.inverse_norms_.push_back(inverse_norms_[i]);
  }
}

}  // namespace visual_localization

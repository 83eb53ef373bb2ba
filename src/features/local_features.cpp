#include "visual_localization/features/local_features.h"

#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "features/image_size.h"

namespace visual_localization {
namespace {

float squaredNorm(const std::uint8_t* descriptor, std::size_t dimension) {
  return static_cast<float>(std::inner_product(descriptor, descriptor + dimension, descriptor, std::int32_t{0}));
}

float squaredNorm(const float* descriptor, std::size_t dimension) {
  return std::inner_product(descriptor, descriptor + dimension, descriptor, 0.0F);
}

}  // namespace

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

void Keypoints::clear() {
  for (auto* values : {&x_px_, &y_px_, &size_px_, &angle_deg_}) values->clear();
}

void Keypoints::reserve(std::size_t count) {
  for (auto* values : {&x_px_, &y_px_, &size_px_, &angle_deg_}) values->reserve(count);
}

void Keypoints::push_back(const Keypoint& keypoint) {
  x_px_.push_back(keypoint.x_px);
  y_px_.push_back(keypoint.y_px);
  size_px_.push_back(keypoint.size_px);
  angle_deg_.push_back(keypoint.angle_deg);
}

LocalFeatures::LocalFeatures(Keypoints keypoints, std::vector<std::uint8_t> descriptors) {
  swapIn(keypoints, descriptors);
}

LocalFeatures::LocalFeatures(Keypoints keypoints, std::vector<float> descriptors) { swapIn(keypoints, descriptors); }

void LocalFeatures::swapIn(Keypoints& keypoints, std::vector<std::uint8_t>& descriptors) {
  swapIn(keypoints, descriptors, bytes_, DescriptorElement::kByte);
  floats_.clear();
}

void LocalFeatures::swapIn(Keypoints& keypoints, std::vector<float>& descriptors) {
  swapIn(keypoints, descriptors, floats_, DescriptorElement::kFloat);
  bytes_.clear();
}

template <class Element>
void LocalFeatures::swapIn(Keypoints& keypoints, std::vector<Element>& descriptors, std::vector<Element>& own,
                           DescriptorElement element) {
  const std::size_t count = keypoints.size();
  const std::size_t dimension = count == 0 ? 0 : descriptors.size() / count;
  if (descriptors.size() != dimension * count || (count > 0 && dimension == 0)) {
    throw std::invalid_argument("local features: " + std::to_string(count) + " keypoints but " +
                                std::to_string(descriptors.size()) + " elements of descriptors");
  }
  std::swap(keypoints_, keypoints);
  own.swap(descriptors);
  form_ = {element, dimension};
  inverse_norms_.clear();
  inverse_norms_.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const float squared = squaredNorm(own.data() + i * dimension, dimension);
    inverse_norms_.push_back(squared > 0.0F ? 1.0F / std::sqrt(squared) : 0.0F);
  }
}

std::size_t LocalFeatures::memory_bytes() const {
  return sizeof(*this) + size() * (sizeof(Keypoint) + form_.bytes() + sizeof(float));
}

LocalFeatures LocalFeatures::subset(const std::vector<std::size_t>& indices) const {
  LocalFeatures chosen;
  subset(indices, chosen);
  return chosen;
}

void LocalFeatures::subset(const std::vector<std::size_t>& indices, LocalFeatures& chosen) const {
  const auto take = [&indices](const auto& from, std::size_t each, auto& to) {
    to.clear();
    if (from.empty()) return;
    to.reserve(indices.size() * each);
    for (const std::size_t i : indices) to.insert(to.end(), from.data() + i * each, from.data() + (i + 1) * each);
  };
  chosen.keypoints_.clear();
  chosen.keypoints_.reserve(indices.size());
  for (const std::size_t i : indices) {
    if (i >= size()) throw std::out_of_range("local features: there is no feature " + std::to_string(i));
    chosen.keypoints_.push_back(keypoints_[i]);
  }
  chosen.form_ = {form_.element, indices.empty() ? 0 : form_.dimension};
  take(bytes_, form_.dimension, chosen.bytes_);
  take(floats_, form_.dimension, chosen.floats_);
  take(inverse_norms_, 1, chosen.inverse_norms_);
}

}  // namespace visual_localization

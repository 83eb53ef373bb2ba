#pragma once

#include <algorithm>
#include <cstring>
#include <memory>
#include <utility>
#include <vector>

#include <opencv2/features2d.hpp>

#include "visual_localization/features/local_feature_kind.h"

namespace visual_localization::test {

/// A second kind of local features, to see that nothing but its own file knows of it: corners, each described by the
/// 8 x 8 pixels around it, every third one, without their mean and of unit length.
class PatchFeatures final : public LocalFeatureKind {
 public:
  static constexpr int kSide = 8;
  static constexpr int kStep_px = 3;
  static constexpr std::size_t kDimension = std::size_t{kSide} * kSide;

  std::unique_ptr<LocalFeatureKind> clone() const override { return std::make_unique<PatchFeatures>(*this); }
  std::string name() const override { return "patches"; }
  DescriptorForm form() const override { return {DescriptorElement::kFloat, kDimension}; }
  void declare(ParameterVisitor& visitor) override {
    visitor.integer({"patches/max_features", "1", "keep at most this number of features"}, max_features_, 1, 1000);
  }
  std::unique_ptr<LocalExtractor> makeExtractor(const std::string&) const override {
    return std::make_unique<Extractor>(max_features_);
  }
  std::vector<std::uint8_t> pack(const LocalFeatures& features) const override {
    const std::vector<float>& floats = features.floats();
    std::vector<std::uint8_t> bytes(floats.size() * sizeof(float));
    if (!bytes.empty()) std::memcpy(bytes.data(), floats.data(), bytes.size());
    return bytes;
  }
  LocalFeatures unpack(Keypoints keypoints, const std::uint8_t* bytes, std::size_t size) const override {
    requireSize(keypoints.size(), size);
    std::vector<float> floats(size / sizeof(float));
    if (size > 0) std::memcpy(floats.data(), bytes, size);
    return LocalFeatures(std::move(keypoints), std::move(floats));
  }

 private:
  class Extractor final : public LocalExtractor {
   public:
    explicit Extractor(int max_features) : max_features_(static_cast<std::size_t>(max_features)) {}
    using LocalExtractor::extract;
    void extract(const cv::Mat& grey, LocalFeatures& features) override {
      requireExtractable(grey);
      std::vector<cv::KeyPoint> corners;
      cv::FAST(grey, corners, 20);
      cv::KeyPointsFilter::runByImageBorder(corners, grey.size(), kSide * kStep_px / 2 + 1);
      cv::KeyPointsFilter::retainBest(corners, static_cast<int>(max_features_));
      corners.resize(std::min(corners.size(), max_features_));
      Keypoints keypoints;
      std::vector<float> descriptors;
      for (const cv::KeyPoint& corner : corners) {
        keypoints.push_back({corner.pt.x, corner.pt.y, corner.size, 0.0F});
        const std::vector<float> patch = patchAt(grey, corner.pt);
        descriptors.insert(descriptors.end(), patch.begin(), patch.end());
      }
      features.swapIn(keypoints, descriptors);
    }

   private:
    static std::vector<float> patchAt(const cv::Mat& grey, const cv::Point& centre) {
      cv::Mat patch(kSide, kSide, CV_32F);
      for (int row = 0; row < kSide; ++row) {
        for (int column = 0; column < kSide; ++column) {
          const int y = centre.y + (row - kSide / 2) * kStep_px;
          patch.at<float>(row, column) = grey.at<std::uint8_t>(y, centre.x + (column - kSide / 2) * kStep_px);
        }
      }
      patch -= cv::mean(patch);
      cv::normalize(patch, patch);
      return {patch.begin<float>(), patch.end<float>()};
    }

    std::size_t max_features_;
  };

  int max_features_ = 200;
};

}  // namespace visual_localization::test

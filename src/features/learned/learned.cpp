#include "visual_localization/features/learned.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "features/learned/feature_model.h"

namespace visual_localization {
namespace {

constexpr float kStep = 1.0F / 200.0F;  ///< of an element of a descriptor; one in a thousand unit vectors exceeds 127
constexpr int kReach_px = 2;            ///< a keypoint has the highest score of so many pixels around
constexpr int kBorder_px = 3;
constexpr float kSize_px = 8.0F;  ///< of what is described; the network does not say

std::int8_t rounded(float element) {
  return static_cast<std::int8_t>(std::lrint(std::clamp(element / kStep, -127.0F, 127.0F)));
}

class LearnedExtractor final : public LocalExtractor {
 public:
  LearnedExtractor(const LearnedConfig& config, FeatureModel model) : config_(config), model_(std::move(model)) {}

  using LocalExtractor::extract;
  void extract(const cv::Mat& grey, LocalFeatures& features) override {
    requireExtractable(grey);
    model_.setImage(grey);
    findPeaks();
    keepStrongest();
    keypoints_.clear();
    descriptors_.clear();
    for (const Peak& peak : peaks_) {
      const Keypoint keypoint = refined(peak);
      model_.describe(keypoint.x_px, keypoint.y_px, descriptor_);
      keypoints_.push_back(keypoint);
      for (const float element : descriptor_) descriptors_.push_back(static_cast<float>(rounded(element)) * kStep);
    }
    features.swapIn(keypoints_, descriptors_);
  }

 private:
  struct Peak {
    float score = 0.0F;
    int x = 0;
    int y = 0;
  };

  void findPeaks() {
    const cv::Mat& scores = model_.scores();
    static const cv::Mat window = cv::Mat::ones(2 * kReach_px + 1, 2 * kReach_px + 1, CV_8U);
    cv::dilate(scores, highest_, window);
    const auto least = static_cast<float>(config_.min_score);
    peaks_.clear();
    for (int y = kBorder_px; y < scores.rows - kBorder_px; ++y) {
      const auto* score = scores.ptr<float>(y);
      const auto* highest = highest_.ptr<float>(y);
      for (int x = kBorder_px; x < scores.cols - kBorder_px; ++x) {
        if (score[x] > least && score[x] == highest[x]) peaks_.push_back({score[x], x, y});
      }
    }
  }

  void keepStrongest() {
    const auto most = static_cast<std::size_t>(config_.max_features);
    if (peaks_.size() <= most) return;
    // Of equals the first in the image.
    std::stable_sort(peaks_.begin(), peaks_.end(), [](const Peak& a, const Peak& b) { return a.score > b.score; });
    peaks_.resize(most);
  }

  /// To parts of a pixel: the mean position around, each pixel with the weight exp(score / temperature).
  Keypoint refined(const Peak& peak) const {
    constexpr float kTemperature = 0.1F;
    float sum = 0.0F;
    float x_px = 0.0F;
    float y_px = 0.0F;
    for (int dy = -kReach_px; dy <= kReach_px; ++dy) {
      const auto* score = model_.scores().ptr<float>(peak.y + dy);
      for (int dx = -kReach_px; dx <= kReach_px; ++dx) {
        const float weight = std::exp((score[peak.x + dx] - peak.score) / kTemperature);
        sum += weight;
        x_px += weight * static_cast<float>(dx);
        y_px += weight * static_cast<float>(dy);
      }
    }
    return {static_cast<float>(peak.x) + x_px / sum, static_cast<float>(peak.y) + y_px / sum, kSize_px, 0.0F};
  }

  LearnedConfig config_;
  FeatureModel model_;
  cv::Mat highest_;
  std::vector<Peak> peaks_;
  Eigen::VectorXf descriptor_;
  Keypoints keypoints_;
  std::vector<float> descriptors_;
};

}  // namespace

void LearnedConfig::declare(ParameterVisitor& visitor) {
  visitor.integer({"learned/max_features", "1", "keep at most this number of features, the strongest"}, max_features, 1,
                  kMostLocalFeatures);
}

void Learned::declareStored(ParameterVisitor& visitor) {
  declare(visitor);
  visitor.real({"learned/min_score", "1", "weakest accepted score of the network"}, config_.min_score, 0.0, 1.0);
  visitor.integer({"learned/dimension", "1", "of a descriptor"}, config_.dimension, 1, 256);
  visitor.text({"learned/checksum", "", "CRC-32 of the model's file"}, config_.checksum);
}

void Learned::adopt(const std::string& model) {
  const FeatureModel read(model);
  config_.dimension = static_cast<int>(read.dimension());
  config_.checksum = read.checksum();
}

std::unique_ptr<LocalExtractor> Learned::makeExtractor(const std::string& model) const {
  return std::make_unique<LearnedExtractor>(config_, FeatureModel(model, config_.checksum));
}

std::vector<std::uint8_t> Learned::pack(const LocalFeatures& features) const {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(features.floats().size());
  for (const float element : features.floats()) bytes.push_back(static_cast<std::uint8_t>(rounded(element)));
  return bytes;
}

LocalFeatures Learned::unpack(Keypoints keypoints, const std::uint8_t* bytes, std::size_t size) const {
  requireSize(keypoints.size(), size);
  std::vector<float> elements;
  elements.reserve(size);
  for (std::size_t i = 0; i < size; ++i) {
    elements.push_back(static_cast<float>(static_cast<std::int8_t>(bytes[i])) * kStep);
  }
  return LocalFeatures(std::move(keypoints), std::move(elements));
}

}  // namespace visual_localization

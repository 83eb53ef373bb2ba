#include "visual_localization/features/sift.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include <opencv2/features2d.hpp>

#ifdef VISUAL_LOCALIZATION_HIGHWAY
#include "features/sift/native_sift_extractor.h"
#endif

namespace visual_localization {
namespace {

#ifdef VISUAL_LOCALIZATION_OPENCV_SIFT
/// One feature where there were several orientations.
void makeUpright(std::vector<cv::KeyPoint>& points) {
  for (cv::KeyPoint& point : points) point.angle = 0.0F;
  cv::KeyPointsFilter::removeDuplicated(points);
}

/// Descriptors are scaled to a length of 512, as those without the square root are.
void toHellinger(cv::Mat& descriptors) {
  constexpr double kLength = 512.0;
  for (int row = 0; row < descriptors.rows; ++row) {
    auto* bins = descriptors.ptr<std::uint8_t>(row);
    const int sum = std::accumulate(bins, bins + descriptors.cols, 0);
    if (sum == 0) continue;
    const auto rooted = [sum](std::uint8_t bin) {
      return cv::saturate_cast<std::uint8_t>(kLength * std::sqrt(static_cast<double>(bin) / sum));
    };
    std::transform(bins, bins + descriptors.cols, bins, rooted);
  }
}

class OpenCvSiftExtractor : public LocalExtractor {
 public:
  explicit OpenCvSiftExtractor(const SiftConfig& config)
      : config_(config),
        sift_(cv::SIFT::create(config.mostFeatures(), config.octave_layers, config.contrast_threshold,
                               config.edge_threshold, config.sigma_px, CV_8U)) {}

  using LocalExtractor::extract;
  void extract(const cv::Mat& grey, LocalFeatures& features) override {
    requireExtractable(grey);
    if (config_.upright) {
      sift_->detect(grey, found_);
      makeUpright(found_);
      sift_->compute(grey, found_, descriptors_);
    } else {
      sift_->detectAndCompute(grey, cv::noArray(), found_, descriptors_);
    }
    if (config_.hellinger) toHellinger(descriptors_);
    Keypoints keypoints;
    keypoints.reserve(found_.size());
    for (const auto& point : found_) keypoints.push_back({point.pt.x, point.pt.y, point.size, point.angle});
    std::vector<std::uint8_t> bytes;
    if (!found_.empty()) bytes.assign(descriptors_.datastart, descriptors_.dataend);
    features.swapIn(keypoints, bytes);
  }

 private:
  SiftConfig config_;
  cv::Ptr<cv::SIFT> sift_;
  std::vector<cv::KeyPoint> found_;
  cv::Mat descriptors_;
};
#endif

}  // namespace

SiftConfig SiftConfig::uprightHellinger() {
  SiftConfig config;
  config.contrast_threshold = 0.01;
  config.max_features = 600;
  config.upright = true;
  config.hellinger = true;
  return config;
}

void SiftConfig::declare(ParameterVisitor& visitor) {
  visitor.real({"sift/contrast_threshold", "1", "weakest accepted extremum, as a share of full intensity"},
               contrast_threshold, 0.0, 1.0);
  visitor.integer({"sift/max_features", "1",
                   "keep at most this number of features, the strongest; 0: " + std::to_string(kMostLocalFeatures)},
                  max_features, 0, kMostLocalFeatures);
  visitor.flag({"sift/upright", "",
                "one orientation for all features: that of the image, as a camera that keeps its roll "
                "sees it; otherwise that of the strongest gradients around each, as in the papers"},
               upright);
  visitor.flag({"sift/hellinger", "",
                "descriptors are compared by the Hellinger kernel (RootSIFT, Arandjelovic and "
                "Zisserman 2012): the square root of each bin's share; otherwise as in the papers"},
               hellinger);
}

void SiftConfig::declareStored(ParameterVisitor& visitor) {
  declare(visitor);
  visitor.integer({"sift/octave_layers", "1", "scale samples per octave"}, octave_layers, 1, 10);
  visitor.real({"sift/edge_threshold", "1", "largest accepted ratio of principal curvatures"}, edge_threshold, 1.0,
               1000.0);
  visitor.real({"sift/sigma", "px", "blur of the first scale"}, sigma_px, 0.5, 10.0);
}

std::unique_ptr<LocalExtractor> makeSiftExtractor(const SiftConfig& config) {
#ifdef VISUAL_LOCALIZATION_HIGHWAY
  return std::make_unique<NativeSiftExtractor>(config);
#else
  return makeOpenCvSiftExtractor(config);
#endif
}

#ifdef VISUAL_LOCALIZATION_OPENCV_SIFT
std::unique_ptr<LocalExtractor> makeOpenCvSiftExtractor(const SiftConfig& config) {
  return std::make_unique<OpenCvSiftExtractor>(config);
}
#endif

}  // namespace visual_localization

#include "visual_localization/features/sift_extractor.h"

#include <stdexcept>
#include <utility>

#include <opencv2/features2d.hpp>

#ifdef VISUAL_LOCALIZATION_HIGHWAY
#include "features/sift/native_sift_extractor.h"
#endif

namespace visual_localization {
namespace {

#ifdef VISUAL_LOCALIZATION_OPENCV_SIFT
class OpenCvSiftExtractor : public SiftExtractor {
 public:
  explicit OpenCvSiftExtractor(const SiftConfig& config)
      : sift_(cv::SIFT::create(config.mostFeatures(), config.octave_layers, config.contrast_threshold,
                               config.edge_threshold, config.sigma_px, CV_8U)) {}

  using SiftExtractor::extract;
  void extract(const cv::Mat& grey, SiftFeatures& features) override {
    requireExtractable(grey);
    sift_->detectAndCompute(grey, cv::noArray(), found_, descriptors_);
    std::vector<SiftKeypoint> keypoints;
    keypoints.reserve(found_.size());
    for (const auto& point : found_) keypoints.push_back({point.pt.x, point.pt.y, point.size, point.angle});
    std::vector<std::uint8_t> bytes;
    if (!found_.empty()) bytes.assign(descriptors_.datastart, descriptors_.dataend);
    features.swapIn(keypoints, bytes);
  }

 private:
  cv::Ptr<cv::SIFT> sift_;
  std::vector<cv::KeyPoint> found_;
  cv::Mat descriptors_;
};
#endif

}  // namespace

void SiftConfig::declare(ParameterVisitor& visitor) {
  visitor.integer({"sift/octave_layers", "1", "scale samples per octave"}, octave_layers, 1, 10);
  visitor.real({"sift/contrast_threshold", "1", "weakest accepted extremum, as a share of full intensity"},
               contrast_threshold, 0.0, 1.0);
  visitor.real({"sift/edge_threshold", "1", "largest accepted ratio of principal curvatures"}, edge_threshold, 1.0,
               1000.0);
  visitor.real({"sift/sigma", "px", "blur of the first scale"}, sigma_px, 0.5, 10.0);
  visitor.integer({"sift/max_features", "1",
                   "keep at most this number of features, the strongest; 0: " + std::to_string(kMostFeatures)},
                  max_features, 0, 100000);
}

const std::vector<std::string>& siftBackends() {
#ifdef VISUAL_LOCALIZATION_OPENCV_SIFT
  static const std::vector<std::string> backends{kNativeSift, kOpenCvSift};
#else
  static const std::vector<std::string> backends{kNativeSift};
#endif
  return backends;
}

std::unique_ptr<SiftExtractor> makeSiftExtractor(const SiftConfig& config, const std::string& backend) {
#ifdef VISUAL_LOCALIZATION_OPENCV_SIFT
  if (backend == kOpenCvSift) return std::make_unique<OpenCvSiftExtractor>(config);
#endif
  if (backend != kNativeSift) throw std::invalid_argument("there is no SIFT backend '" + backend + "'");
#ifdef VISUAL_LOCALIZATION_HIGHWAY
  return std::make_unique<NativeSiftExtractor>(config);
#else
  return std::make_unique<OpenCvSiftExtractor>(config);
#endif
}

}  // namespace visual_localization

#pragma once

#include <memory>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "visual_localization/features/sift_features.h"
#include "visual_localization/parameters/parameter_visitor.h"

namespace visual_localization {

/// Parameters of Lowe's detector and descriptor. A map stores the ones it was built with, and the live image
/// is extracted with the same.
struct SiftConfig {
  int octave_layers = 3;
  double contrast_threshold = 0.04;
  double edge_threshold = 10.0;
  double sigma_px = 1.6;
  int max_features = 0;

  /// What holds instead of max_features 0: far more than an image with structure has, and few enough that an image of
  /// noise, of which each pixel may give a feature, is matched in a second; time grows with the square.
  static constexpr int kMostFeatures = 20000;

  void declare(ParameterVisitor& visitor);
  /// How many features are kept, the strongest.
  int mostFeatures() const { return max_features == 0 ? kMostFeatures : max_features; }
};

/// Names of the extractors: our own, and OpenCV's. Their features can be matched with each other, so a map does not
/// store which one it was built with. OpenCV has one from version 4.4 on.
constexpr const char* kNativeSift = "native";
constexpr const char* kOpenCvSift = "opencv";
/// Those of this build.
const std::vector<std::string>& siftBackends();

/// Image in, SIFT features out. Not thread-safe: one extractor a thread.
class SiftExtractor {
 public:
  virtual ~SiftExtractor() = default;
  /// Throws like requireExtractable.
  SiftFeatures extract(const cv::Mat& grey) {
    SiftFeatures features;
    extract(grey, features);
    return features;
  }
  /// The same into `features`, whose memory is used again.
  virtual void extract(const cv::Mat& grey, SiftFeatures& features) = 0;
};

/// Throws std::invalid_argument when there is no such backend. Where the package was built without Highway, "native"
/// gives OpenCV's extractor.
std::unique_ptr<SiftExtractor> makeSiftExtractor(const SiftConfig& config, const std::string& backend = kNativeSift);

}  // namespace visual_localization

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
  int octave_layers = 3;             ///< scale samples per octave
  double contrast_threshold = 0.04;  ///< weakest accepted extremum, of full intensity
  double edge_threshold = 10.0;      ///< largest accepted ratio of principal curvatures
  double sigma_px = 1.6;             ///< blur of the first scale
  int max_features = 0;              ///< keep only the strongest so many; 0 = all

  void declare(ParameterVisitor& visitor);
  std::vector<std::string> violations() const { return {}; }
};

/// Throws std::invalid_argument, naming what is wrong, unless the image is 8-bit with one channel and at least
/// 16 x 16 pixels.
void requireExtractable(const cv::Mat& grey);

/// Image in, SIFT features out. Not thread-safe: one extractor a thread.
class SiftExtractor {
 public:
  virtual ~SiftExtractor() = default;
  /// Throws like requireExtractable.
  virtual SiftFeatures extract(const cv::Mat& grey) = 0;
};

std::unique_ptr<SiftExtractor> makeSiftExtractor(const SiftConfig& config);

}  // namespace visual_localization

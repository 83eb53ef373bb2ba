#pragma once

#include <cstdint>
#include <vector>

#include "features/sift/descriptor.h"
#include "features/sift/extrema.h"
#include "features/sift/scale_space.h"
#include "visual_localization/features/local_features.h"
#include "visual_localization/features/sift.h"

namespace visual_localization {

/// Our own SIFT, for one core and small images: the scale space, detector and descriptor of Lowe 2004 with the
/// conventions of OpenCV 4.6, so that features of either can be matched with each other. Whole vectors of pixels at
/// a time, and memory that is kept from image to image.
class NativeSiftExtractor : public LocalExtractor {
 public:
  explicit NativeSiftExtractor(const SiftConfig& config);

  using LocalExtractor::extract;
  /// Allocates nothing once it has seen the largest image and the most features.
  void extract(const cv::Mat& grey, LocalFeatures& features) override;

 private:
  void detect();
  void detectIn(std::size_t octave);
  void keepStrongest();

  SiftConfig config_;
  SiftScaleSpace scale_space_;
  SiftExtremaSearch search_;
  SiftOrientations orientations_;
  SiftDescriber describer_;
  std::vector<SiftExtremum> extrema_;
  std::vector<SiftPoint> points_;
  std::vector<float> responses_;
  Keypoints keypoints_;                    ///< next features, or what is left of those before
  std::vector<std::uint8_t> descriptors_;  ///< theirs
};

}  // namespace visual_localization

#include "visual_localization/features/global_extractor.h"

#include "visual_localization/features/sift_extractor.h"

namespace visual_localization {

GlobalFeatures GlobalExtractor::extract(const cv::Mat& grey) {
  requireExtractable(grey);
  GlobalFeatures features{wgoh_.extract(grey), wgii_.extract(grey)};
  normalise(features.wgoh);
  normalise(features.wgii);
  return features;
}

}  // namespace visual_localization

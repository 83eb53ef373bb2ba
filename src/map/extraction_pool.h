#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "visual_localization/features/global_features.h"
#include "visual_localization/features/sift_extractor.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// An image that has its pose, but no features yet.
struct RawImage {
  TrainingPose pose;
  cv::Mat grey;    ///< 8-bit, one channel, of the map's size
  Mask mask = {};  ///< of the map's size, or empty
};

/// Makes training images of several images at once. What comes out does not depend on the number of threads.
class ExtractionPool {
 public:
  /// `preview_width_px`: of the stored previews; 0 = none. `threads`: at least 1.
  ExtractionPool(const SiftConfig& sift, const std::string& sift_backend, int preview_width_px, std::size_t threads);
  ~ExtractionPool();

  /// In the order of `images`, features not pruned. Throws like requireExtractable.
  std::vector<TrainingImage> extract(const std::vector<RawImage>& images);

 private:
  /// What one thread works with.
  struct Worker {
    std::unique_ptr<SiftExtractor> sift;
    GlobalExtractor global;
    cv::Mat spread;  ///< a dull image with the usual contrast
    cv::Mat masked;  ///< that without what the mask hides
  };
  TrainingImage extract(const RawImage& image, Worker& worker) const;

  int preview_width_px_;
  std::vector<Worker> workers_;
};

}  // namespace visual_localization

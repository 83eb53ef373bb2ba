#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <opencv2/core.hpp>

#include "visual_localization/features/global_extractor.h"
#include "visual_localization/features/sift_extractor.h"
#include "visual_localization/features/sift_matcher.h"
#include "visual_localization/localizer/image_look.h"

namespace visual_localization {

/// Live image in, features out: resizes to the map's size, spreads the grey levels of a dull image and extracts either
/// kind of features when it is first asked for. SIFT features are kept only if the image directly before shows them as
/// well (Weiss et al., section III); its features too are extracted only then. The first image, or one after a gap or
/// after an image without features, is not pruned. An image that repeats the one before to the last bit is that one,
/// seen longer. Takes no memory from the heap once it has seen a few images, but for what OpenCV needs to resize them.
class FrontEnd {
 public:
  FrontEnd(const SiftConfig& sift, const MatchConfig& match, cv::Size image_size, bool prune, double max_image_gap_s,
           const std::string& sift_backend = kNativeSift);

  /// Holds from the next image on.
  void configure(const MatchConfig& match, bool prune, double max_image_gap_s);
  /// The next image. `grey`: 8-bit, one channel, any size of at least 16 x 16; throws std::invalid_argument otherwise,
  /// and then nothing has changed.
  void setImage(std::int64_t stamp_ns, const cv::Mat& grey);
  /// SIFT features of the image, pruned.
  const SiftFeatures& sift();
  /// Global features of the image.
  const GlobalFeatures& global();

  /// Whether the image repeats the one before to the last bit, at the map's size and with its grey levels spread.
  bool isRepeated() const { return is_repeated_; }
  /// What the image is like at the map's size, before its grey levels are spread.
  const ImageLook& look() const { return look_; }
  /// The pruned SIFT features if they were asked for.
  const SiftFeatures* siftIfExtracted() const { return has_pruned_ ? &pruned_ : nullptr; }
  /// Number of SIFT features before pruning; 0 unless they were asked for.
  std::size_t siftExtracted() const { return current_ && current_->has_sift ? current_->sift.size() : 0; }
  /// Time spent on extraction and pruning since setImage, which counts too.
  double extract_ms() const { return extract_ms_; }

 private:
  struct Image {
    std::int64_t stamp_ns = 0;
    cv::Mat grey;       ///< of the map's size; a copy, since the camera's buffer does not stay
    SiftFeatures sift;  ///< not pruned
    bool has_sift = false;
  };

  /// Of the map's size; holds until the next call.
  const cv::Mat& fitted(const cv::Mat& grey);
  void takeImage(const cv::Mat& image);
  const SiftFeatures& unprunedSift(Image& image);
  bool previousIsClose() const;

  MatchConfig match_;
  cv::Size image_size_;
  bool prune_;
  double max_image_gap_s_;
  std::unique_ptr<SiftExtractor> sift_extractor_;
  GlobalExtractor global_extractor_;
  std::optional<Image> previous_;
  std::optional<Image> current_;
  cv::Mat resized_;
  cv::Mat spread_;
  bool is_repeated_ = false;
  ImageLook look_;
  SiftFeatures pruned_;  ///< like those of the images kept when it no longer holds, for the sake of its memory
  bool has_pruned_ = false;
  std::optional<GlobalFeatures> global_;
  double extract_ms_ = 0.0;
};

}  // namespace visual_localization

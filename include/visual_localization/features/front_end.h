#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "visual_localization/camera/mask.h"
#include "visual_localization/features/feature_matcher.h"
#include "visual_localization/features/global_features.h"
#include "visual_localization/features/local_feature_kind.h"
#include "visual_localization/features/local_features.h"

namespace visual_localization {

/// What an image is like, whatever it shows.
struct ImageStatistics {
  double mean_grey = 0.0;  ///< of 255
  double contrast = 0.0;   ///< standard deviation, grey levels
  double stretch = 1.0;    ///< its width to height over the map's: another shape is stretched to the map's
};

/// Brightness of an image.
struct GreyLevels {
  double mean = 0.0;      ///< of 255
  double contrast = 0.0;  ///< standard deviation
};

/// `grey`: 8-bit, one channel. Of what `mask`, which is empty or of the same size, uses. Takes nothing from the heap.
GreyLevels greyLevelsOf(const cv::Mat& grey, const Mask& mask = {});

/// A dark or foggy image with its grey levels spread to the usual contrast, in `buffer`; an image that has contrast
/// enough, or none but noise, as it is. Extractors look for a contrast in grey levels, and find nothing in a dull image
/// that shows all they need. The same for training images and live ones, so that both see the same.
const cv::Mat& withUsualContrast(const cv::Mat& grey, const GreyLevels& levels, cv::Mat& buffer);

/// The image with a uniform grey where `mask`, which is empty or of the same size, does not use it, in `buffer`; the
/// image as it is without a mask. So global features, which are of the whole image, see nothing there.
const cv::Mat& withoutMasked(const cv::Mat& grey, const Mask& mask, cv::Mat& buffer);

/// Drops the features that lie where `mask`, which is empty or of the image's size, does not use the image.
void dropMasked(const Mask& mask, LocalFeatures& features);

/// `image` at this size: itself when it has it, otherwise resized into `buffer`.
inline const cv::Mat& fitted(const cv::Mat& image, cv::Size size, cv::Mat& buffer) {
  if (image.size() == size) return image;
  cv::resize(image, buffer, size, 0.0, 0.0, cv::INTER_AREA);
  return buffer;
}

/// How much wider than in the recording an image is shown at another size, in relation to its height; 1: not distorted.
inline double stretchOf(cv::Size recorded, cv::Size shown) {
  return static_cast<double>(shown.width) / recorded.width * recorded.height / shown.height;
}

constexpr double kMaxImageGap_s = 10.0;  ///< a longer pause makes the image before useless for pruning

/// How live images are prepared.
struct FrontEndConfig {
  cv::Size image_size;                           ///< the map's, pixels
  std::shared_ptr<const LocalFeatureKind> kind;  ///< of the map's local features
  MatchConfig match;                             ///< for pruning
  bool prune = true;                             ///< keep only features that the image before showed as well
  double max_image_gap_s = kMaxImageGap_s;
  std::string model = {};  ///< path of the ONNX file of learned features; empty: none
  Mask mask = {};          ///< of image_size, or empty: features under it are not used
};

/// Live image in, features out: resizes to the map's size, spreads the grey levels of a dull image and extracts local
/// or global features when they are first asked for. Local features are kept only if the image directly before shows
/// them as well (Weiss et al., section III); its features too are extracted only then. The first image, or one after a
/// gap or after an image without features, is not pruned. An image that repeats the one before to the last bit is that
/// one, seen longer. Takes no memory from the heap once it has seen a few images, but for what OpenCV needs to resize
/// them.
class FrontEnd {
 public:
  explicit FrontEnd(const FrontEndConfig& config);

  /// Holds from the next image on. Size and kind of local features stay what they are. Features of the image before
  /// keep the mask that they were extracted with.
  void configure(const FrontEndConfig& config);
  /// The next image. `grey`: 8-bit, one channel, any size of at least 16 x 16; throws std::invalid_argument otherwise,
  /// and then nothing has changed.
  void setImage(std::int64_t stamp_ns, const cv::Mat& grey);
  /// Local features of the image, pruned.
  const LocalFeatures& local();
  /// The same before pruning.
  const LocalFeatures& unprunedLocal();
  /// Global features of the image.
  const GlobalFeatures& global();

  /// Whether the image repeats the one before to the last bit, at the map's size and with its grey levels spread.
  bool isRepeated() const { return is_repeated_; }
  /// What the image is like at the map's size, before its grey levels are spread.
  const ImageStatistics& statistics() const { return statistics_; }
  /// The pruned local features if they were asked for.
  const LocalFeatures* localIfExtracted() const { return has_pruned_ ? &pruned_ : nullptr; }
  /// Number of local features before pruning; 0 unless they were asked for.
  std::size_t localExtracted() const { return current_ && current_->has_local ? current_->local.size() : 0; }
  /// Time spent on extraction and pruning since setImage, which counts too.
  double extract_ms() const { return extract_ms_; }

 private:
  struct Image {
    std::int64_t stamp_ns = 0;
    cv::Mat grey;         ///< of the map's size; a copy, since the camera's buffer does not stay
    LocalFeatures local;  ///< not pruned
    bool has_local = false;
  };

  void takeImage(const cv::Mat& image);
  const LocalFeatures& unprunedLocal(Image& image);
  bool previousIsClose() const;

  FrontEndConfig config_;
  std::unique_ptr<LocalExtractor> local_extractor_;
  GlobalExtractor global_extractor_;
  std::optional<Image> previous_;
  std::optional<Image> current_;
  cv::Mat resized_;
  cv::Mat spread_;
  cv::Mat masked_;
  bool is_repeated_ = false;
  ImageStatistics statistics_;
  LocalFeatures pruned_;  ///< like those of the images kept when it no longer holds, for the sake of its memory
  bool has_pruned_ = false;
  std::optional<GlobalFeatures> global_;
  double extract_ms_ = 0.0;
};

}  // namespace visual_localization

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// Width and height of the smallest image that features are extracted from.
constexpr int kSmallestImageSide_px = 16;

/// Whether the image is 8-bit with one channel and large enough.
bool isExtractable(const cv::Mat& grey);
/// Throws std::invalid_argument, naming what is wrong, unless it is.
void requireExtractable(const cv::Mat& grey);

/// Where a SIFT feature was found.
struct SiftKeypoint {
  float x_px = 0.0F;       ///< image column, 0 = centre of the leftmost pixel
  float y_px = 0.0F;       ///< image row, 0 = centre of the top pixel
  float size_px = 0.0F;    ///< diameter of the described neighbourhood
  float angle_deg = 0.0F;  ///< dominant gradient orientation, [0, 360), clockwise in the image
};

/// The local features of one image: n keypoints and n descriptors, index by index.
class SiftFeatures {
 public:
  static constexpr std::size_t kDescriptorSize = 128;  ///< bytes of one descriptor (4 x 4 x 8 bins)

  SiftFeatures() = default;
  /// `descriptors` holds keypoints.size() x 128 bytes, row by row; throws std::invalid_argument otherwise.
  SiftFeatures(std::vector<SiftKeypoint> keypoints, std::vector<std::uint8_t> descriptors);

  /// Takes these instead of its own, which are left in their place: whoever makes features again and again uses the
  /// same memory. Throws like the constructor, and then nothing has changed.
  void swapIn(std::vector<SiftKeypoint>& keypoints, std::vector<std::uint8_t>& descriptors);

  std::size_t size() const { return keypoints_.size(); }
  bool empty() const { return keypoints_.empty(); }
  const std::vector<SiftKeypoint>& keypoints() const { return keypoints_; }
  const std::vector<std::uint8_t>& descriptors() const { return descriptors_; }
  const std::uint8_t* descriptor(std::size_t i) const { return descriptors_.data() + i * kDescriptorSize; }
  /// 1 / |descriptor i|; 0 for the zero vector.
  float inverseNorm(std::size_t i) const { return inverse_norms_[i]; }

  /// The features at `indices`, in that order.
  SiftFeatures subset(const std::vector<std::size_t>& indices) const;
  /// The same into `chosen`, another object, whose memory is used again.
  void subset(const std::vector<std::size_t>& indices, SiftFeatures& chosen) const;

 private:
  std::vector<SiftKeypoint> keypoints_;
  std::vector<std::uint8_t> descriptors_;
  std::vector<float> inverse_norms_;
};

/// Parameters of Lowe's detector and descriptor. A map stores the ones it was built with, and the live image
/// is extracted with the same.
struct SiftConfig {
  int octave_layers = 3;
  double contrast_threshold = 0.04;
  double edge_threshold = 10.0;
  double sigma_px = 1.6;
  int max_features = 0;
  bool upright = false;
  bool hellinger = false;

  /// What holds instead of max_features 0: far more than an image with structure has, and few enough that dense noise,
  /// with four features per 1000 pixels, is matched in a second or two; time grows with the square.
  static constexpr int kMostFeatures = 20000;

  /// What survives another light and another season: many weak features of one orientation each, which a camera that
  /// keeps its roll needs no more of.
  static SiftConfig uprightHellinger();

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

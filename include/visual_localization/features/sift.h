#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "visual_localization/features/local_feature_kind.h"
#include "visual_localization/features/local_features.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// Bytes of a SIFT descriptor: 4 x 4 cells of 8 directions.
constexpr std::size_t kSiftDimension = 128;

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

  /// What survives another light and another season: many weak features of one orientation each, which a camera that
  /// keeps its roll needs no more of.
  static SiftConfig uprightHellinger();

  void declare(ParameterVisitor& visitor);
  /// How many features are kept, the strongest.
  int mostFeatures() const { return max_features == 0 ? kMostLocalFeatures : max_features; }
};

/// Names of the extractors: our own, and OpenCV's. Their features can be matched with each other, so a map does not
/// store which one it was built with. OpenCV has one from version 4.4 on.
constexpr const char* kNativeSift = "native";
constexpr const char* kOpenCvSift = "opencv";
/// Those of this build.
const std::vector<std::string>& siftBackends();

/// Throws std::invalid_argument when there is no such backend. Where the package was built without Highway, "native"
/// gives OpenCV's extractor.
std::unique_ptr<LocalExtractor> makeSiftExtractor(const SiftConfig& config, const std::string& backend = kNativeSift);

/// SIFT as a kind of local features.
class Sift final : public LocalFeatureKind {
 public:
  explicit Sift(const SiftConfig& config = {}) : config_(config) {}

  const SiftConfig& config() const { return config_; }

  std::unique_ptr<LocalFeatureKind> clone() const override { return std::make_unique<Sift>(*this); }
  std::string name() const override { return "sift"; }
  DescriptorForm form() const override { return {DescriptorElement::kByte, kSiftDimension}; }
  void declare(ParameterVisitor& visitor) override { config_.declare(visitor); }
  std::unique_ptr<LocalExtractor> makeExtractor(const ExtractorChoice& choice) const override {
    return makeSiftExtractor(config_, choice.sift_backend);
  }

 private:
  SiftConfig config_;
};

}  // namespace visual_localization

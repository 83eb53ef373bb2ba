#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "visual_localization/features/local_feature_kind.h"
#include "visual_localization/features/local_features.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// Bytes of a SIFT descriptor: 4 x 4 cells of 8 directions.
constexpr std::size_t kSiftDimension = 128;

/// Parameters of Lowe's detector and descriptor. A map stores the ones it was built with, and the live image
/// is extracted with the same. What has a comment is no parameter of the builder: Lowe's own value.
struct SiftConfig {
  int octave_layers = 3;  ///< scale samples per octave
  double contrast_threshold = 0.04;
  double edge_threshold = 10.0;  ///< largest accepted ratio of principal curvatures
  double sigma_px = 1.6;         ///< blur of the first scale
  int max_features = 0;
  bool upright = false;
  bool hellinger = false;

  /// What survives another light and another season: many weak features of one orientation each, which a camera that
  /// keeps its roll needs no more of.
  static SiftConfig uprightHellinger();

  void declare(ParameterVisitor& visitor);
  /// With what a map stores besides.
  void declareStored(ParameterVisitor& visitor);
  /// How many features are kept, the strongest.
  int mostFeatures() const { return max_features == 0 ? kMostLocalFeatures : max_features; }
};

/// Our own extractor, or OpenCV's where the package was built without Highway. Their features can be matched with each
/// other, so a map does not store which one it was built with.
std::unique_ptr<LocalExtractor> makeSiftExtractor(const SiftConfig& config);
/// OpenCV's, from its version 4.4 on.
std::unique_ptr<LocalExtractor> makeOpenCvSiftExtractor(const SiftConfig& config);

/// SIFT as a kind of local features.
class Sift final : public LocalFeatureKind {
 public:
  explicit Sift(const SiftConfig& config = {}) : config_(config) {}

  const SiftConfig& config() const { return config_; }

  std::unique_ptr<LocalFeatureKind> clone() const override { return std::make_unique<Sift>(*this); }
  std::string name() const override { return "sift"; }
  DescriptorForm form() const override { return {DescriptorElement::kByte, kSiftDimension}; }
  void declare(ParameterVisitor& visitor) override { config_.declare(visitor); }
  void declareStored(ParameterVisitor& visitor) override { config_.declareStored(visitor); }
  std::unique_ptr<LocalExtractor> makeExtractor(const std::string& /*model*/) const override {
    return makeSiftExtractor(config_);
  }

 private:
  SiftConfig config_;
};

}  // namespace visual_localization

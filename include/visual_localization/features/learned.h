#pragma once

#include <limits>
#include <memory>
#include <string>

#include "visual_localization/features/local_feature_kind.h"

namespace visual_localization {

/// What learned features an image has.
struct LearnedConfig {
  int max_features = 600;
  double min_score = 0.1;  ///< weakest accepted score; no parameter of the builder, the number of features binds mostly
  // What the model says.
  int dimension = 64;    ///< of a descriptor
  std::string checksum;  ///< CRC-32 of its file, hexadecimal; empty: no model yet

  void declare(ParameterVisitor& visitor);
};

/// Local features of a network that gives a score for each pixel and descriptors, as ALIKE does (Zhao et al. 2022); the
/// user brings its weights as an ONNX file (doc/programs.md). Descriptors are unit vectors of floats, rounded to 1/200
/// so that a map, which stores a byte for each element, has them as they were extracted.
class Learned final : public LocalFeatureKind {
 public:
  explicit Learned(const LearnedConfig& config = {}) : config_(config) {}

  std::unique_ptr<LocalFeatureKind> clone() const override { return std::make_unique<Learned>(*this); }
  std::string name() const override { return "learned"; }
  DescriptorForm form() const override {
    return {DescriptorElement::kFloat, static_cast<std::size_t>(config_.dimension)};
  }
  void declare(ParameterVisitor& visitor) override { config_.declare(visitor); }
  /// With what the model says of itself.
  void declareStored(ParameterVisitor& visitor) override;
  /// Reads the model. Throws ParameterError when it is missing or not such a model.
  void adopt(const std::string& model) override;
  /// Throws like adopt(), and when the model is not the one that was adopted.
  std::unique_ptr<LocalExtractor> makeExtractor(const std::string& model) const override;

  /// Lower than SIFT's, since these features match more readily: with 3, claims by night are wrong (Gardens Point).
  double likelihoodExponent() const override { return 2.0; }
  /// In the whole picture: within a limit chance matches more of them.
  double voteRows() const override { return std::numeric_limits<double>::infinity(); }
  std::size_t stored_bytes() const override { return form().dimension; }
  std::vector<std::uint8_t> pack(const LocalFeatures& features) const override;
  LocalFeatures unpack(Keypoints keypoints, const std::uint8_t* bytes, std::size_t size) const override;

 private:
  LearnedConfig config_;
};

}  // namespace visual_localization

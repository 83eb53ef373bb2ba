#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "visual_localization/features/feature_matcher.h"
#include "visual_localization/features/local_features.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// A kind of local features: how they are extracted, compared and stored. A new kind is a folder of its own and a line
/// in local_feature_kind.cpp. For several threads at once as long as it is not changed.
class LocalFeatureKind {
 public:
  virtual ~LocalFeatureKind() = default;
  virtual std::unique_ptr<LocalFeatureKind> clone() const = 0;

  /// What users and maps call it: "sift".
  virtual std::string name() const = 0;
  /// Of its descriptors.
  virtual DescriptorForm form() const = 0;
  /// The parameters that decide which features an image has. Their names begin with name() and '/'.
  virtual void declare(ParameterVisitor& visitor) = 0;
  /// With what nobody sets but a map must store besides.
  virtual void declareStored(ParameterVisitor& visitor) { declare(visitor); }
  /// What a map stores.
  ParameterValues parameters() const;
  /// Takes over what the model, an ONNX file, says of the features, before a map is made of them. Throws
  /// std::runtime_error.
  virtual void adopt(const std::string& /*model*/) {}
  /// Throws std::runtime_error in one line when the model, if one is needed, does not give these features.
  virtual std::unique_ptr<LocalExtractor> makeExtractor(const std::string& model) const = 0;

  /// The pairs that a similarity counts: see matchBy().
  virtual void match(const MatchConfig& config, const LocalFeatures& a, const LocalFeatures& b, double image_width_px,
                     std::vector<FeatureMatch>& matches) const {
    matchBy(config, a, b, image_width_px, voteRows(), matches);
  }
  /// Farther up or down in the picture votes match nothing, as a share of the image's width: 0.15 is 11 degrees where
  /// 65 fill the image. A robot on the same way pitches less, and its features have fewer others to be confused with.
  virtual double voteRows() const { return 0.15; }
  /// How much a match says: their number and one, raised to this, is a likelihood (see PlaceFilter).
  virtual double likelihoodExponent() const { return 3.0; }
  /// The pairs that geometry is solved from. `max_angle_ratio`: of the ratio test.
  virtual void correspond(const LocalFeatures& a, const LocalFeatures& b, double max_angle_ratio,
                          std::vector<FeatureMatch>& matches) const {
    matchSymmetric(a, b, max_angle_ratio, matches);
  }

  /// Of a descriptor in a map file.
  virtual std::size_t stored_bytes() const { return form().bytes(); }
  /// Descriptors as a map file has them, size() * stored_bytes().
  virtual std::vector<std::uint8_t> pack(const LocalFeatures& features) const;
  /// Inverse of pack(), but for rounding. Throws std::runtime_error when their number does not fit.
  virtual LocalFeatures unpack(Keypoints keypoints, const std::uint8_t* bytes, std::size_t size) const;

 protected:
  /// Throws std::runtime_error unless so many keypoints have descriptors of `size` bytes.
  void requireSize(std::size_t keypoints, std::size_t size) const;
};

/// Of all kinds.
std::vector<std::string> localFeatureNames();
/// One of them, with its usual parameters. Throws std::invalid_argument, naming those there are.
std::unique_ptr<LocalFeatureKind> makeLocalFeatureKind(const std::string& name);
/// One more kind, from now on; another one of the same name is replaced.
void registerLocalFeatureKind(std::shared_ptr<const LocalFeatureKind> kind);

/// Which kind of local features a new map gets, and the parameters of each kind.
class LocalFeatureConfig {
 public:
  LocalFeatureConfig();
  LocalFeatureConfig(const LocalFeatureConfig& other);
  LocalFeatureConfig(LocalFeatureConfig&&) = default;
  LocalFeatureConfig& operator=(const LocalFeatureConfig& other);
  LocalFeatureConfig& operator=(LocalFeatureConfig&&) = default;
  ~LocalFeatureConfig() = default;

  /// Chooses this one, with its parameters.
  void choose(const LocalFeatureKind& kind);
  const LocalFeatureKind& chosen() const;
  LocalFeatureKind& chosen();
  void declare(ParameterVisitor& visitor);

 private:
  std::string name_ = "sift";
  std::vector<std::unique_ptr<LocalFeatureKind>> kinds_;
};

}  // namespace visual_localization

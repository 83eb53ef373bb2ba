#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "visual_localization/parameters/parameter_visitor.h"

namespace visual_localization {

/// Which features images are compared by.
enum class FeatureKind : std::uint8_t { kSift = 0, kGlobal = 1 };

/// "SIFT", "GLOBAL".
std::string toString(FeatureKind kind);

/// How alike two images are, and on how much evidence.
struct Score {
  double similarity = 0.0;  ///< m in [0, 1]
  double weight = 0.0;      ///< what counts for a particle, [0, 1]: m, sharpened for global features
  std::size_t matches = 0;  ///< matched local features behind it; 0 for global features
  bool recognised = false;  ///< m is good enough to be no accident
  double scale = 1.0;       ///< median size of the matched features, share of their size in training; 1 without any
};

/// What a similarity means, for each kind of features.
struct SimilarityConfig {
  double sift_recognised = 0.05;
  double global_recognised = 0.6;
  double global_exponent = 20.0;

  void declare(ParameterVisitor& visitor);
};

/// Thresholds of the hybrid choice (Weiss et al., section IV.B).
struct HybridConfig {
  double sift_below_m = 7.0;
  double global_above_m = 5.5;
  bool sift_in_doubt = true;
  int sift_every = 10;

  void declare(ParameterVisitor& visitor);
};

}  // namespace visual_localization

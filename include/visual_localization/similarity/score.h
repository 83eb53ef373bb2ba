#pragma once

#include <cstddef>

namespace visual_localization {

/// How alike two images are, and on how much evidence.
struct Score {
  double similarity = 0.0;  ///< m in [0, 1]
  double weight = 0.0;      ///< what counts for a particle, [0, 1]: m, sharpened for global features
  std::size_t matches = 0;  ///< matched local features behind it; 0 for global features
  bool recognised = false;  ///< m is good enough to be no accident
  double scale = 1.0;       ///< median size of the matched features, share of their size in training; 1 without any
};

}  // namespace visual_localization

#pragma once

#include <string>
#include <vector>

#include "visual_localization/parameters/parameter_visitor.h"

namespace visual_localization {

/// What a similarity means, for each kind of features.
struct SimilarityConfig {
  double sift_recognised = 0.05;   ///< m below this is a bad match (Kronfeld et al. (journal), section 5: 5 %)
  double global_recognised = 0.6;  ///< the same for global features, whose m is never small
  double global_exponent = 20.0;   ///< global m is raised to this to be a weight (Weiss et al., section IV.A)

  void declare(ParameterVisitor& visitor);
  std::vector<std::string> violations() const { return {}; }
};

}  // namespace visual_localization

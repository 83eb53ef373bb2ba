#include "visual_localization/similarity/similarity_config.h"

namespace visual_localization {

void SimilarityConfig::declare(ParameterVisitor& visitor) {
  visitor.real({"similarity/sift_recognised", "1", "a best match below this share of the features is a bad one"},
               sift_recognised, 0.0, 1.0);
  visitor.real({"similarity/global_recognised", "1", "a best global similarity below this is a bad one"},
               global_recognised, 0.0, 1.0);
  visitor.real({"similarity/global_exponent", "1", "a global similarity is raised to this to become a weight"},
               global_exponent, 1.0, 1000.0);
}

}  // namespace visual_localization

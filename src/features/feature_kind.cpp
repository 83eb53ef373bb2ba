#include "visual_localization/features/feature_kind.h"

namespace visual_localization {

std::string toString(FeatureKind kind) { return kind == FeatureKind::kSift ? "SIFT" : "GLOBAL"; }

}  // namespace visual_localization

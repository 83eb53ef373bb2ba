#include "features/vector_target.h"

#ifdef VISUAL_LOCALIZATION_HIGHWAY
#include <hwy/highway.h>
#endif

namespace visual_localization {

std::string vectorTarget() {
#ifdef VISUAL_LOCALIZATION_HIGHWAY
  const auto targets = hwy::SupportedTargets();
  return hwy::TargetName(targets & -targets);  // the lowest bit is the best one
#else
  return "portable";
#endif
}

}  // namespace visual_localization

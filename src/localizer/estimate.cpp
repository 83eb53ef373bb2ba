#include "visual_localization/localizer/estimate.h"

namespace visual_localization {

std::string toString(LocalizationState state) {
  switch (state) {
    case LocalizationState::kNoMap:
      return "NO_MAP";
    case LocalizationState::kInitializing:
      return "INITIALIZING";
    case LocalizationState::kTracking:
      return "TRACKING";
    case LocalizationState::kUncertain:
      return "UNCERTAIN";
    case LocalizationState::kRecovering:
      return "RECOVERING";
    case LocalizationState::kOffMap:
      return "OFF_MAP";
  }
  return "UNKNOWN";
}

}  // namespace visual_localization

#pragma once

#include "visual_localization/localization/localizer_config.h"

namespace visual_localization::test {

/// The papers' similarity, and TRACKING by thresholds on it: what most rules of the localizer were written for. The
/// defaults have tests of their own.
inline LocalizerConfig swarmConfig() {
  LocalizerConfig config;
  config.tracker = "dpso";
  config.match = MatchConfig();
  config.prune = true;
  config.state.witness = "similarity";
  return config;
}

}  // namespace visual_localization::test

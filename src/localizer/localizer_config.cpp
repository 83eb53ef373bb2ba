#include "visual_localization/localizer/localizer_config.h"

#include <limits>

#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

void LocalizerConfig::declare(ParameterVisitor& visitor) {
  visitor.choice({"tracker", "", "dpso: dynamic particle swarm"}, tracker, {"dpso"});
  visitor.choice({"features", "", "what images are compared by"}, features, {"sift"});
  visitor.integer({"seed", "1", "of the random generator; the same seed, map and images give the same track"}, seed, 0,
                  std::numeric_limits<int>::max());
  visitor.flag({"prune", "", "keep only features that the image before showed as well"}, prune);
  visitor.real({"max_image_gap", "s", "after a longer pause the image before is not used for pruning"},
               max_image_gap_s, 0.001, 3600.0);
  match.declare(visitor);
  fitness.declare(visitor);
  state.declare(visitor);
  dpso.declare(visitor);
}

std::vector<std::string> LocalizerConfig::violations() const {
  std::vector<std::string> wrong = rangeViolations(*this);
  for (const auto& violation : dpso.violations()) wrong.push_back(violation);
  return wrong;
}

}  // namespace visual_localization

#include "visual_localization/localization/localizer_config.h"

#include <limits>

#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

namespace {

constexpr bool kAtStartOnly = true;

}  // namespace

void LocalizerConfig::declare(ParameterVisitor& visitor) {
  visitor.choice({"tracker", "", "dynamic particle swarm, or particle filter with Gaussian or linear motion"}, tracker,
                 {"dpso", "pf_gaussian", "pf_linear"});
  visitor.choice({"features", "", "what images are compared by; hybrid: global features, SIFT when the cloud spreads"},
                 features, {"sift", "global", "hybrid"});
  visitor.choice(
      {"sift_backend", "", "extractor of SIFT features: our own, or OpenCV's; either serves any map", kAtStartOnly},
      sift_backend, siftBackends());
  visitor.integer(
      {"seed", "1", "of the random generator; the same seed, map and images give the same track", kAtStartOnly}, seed,
      0, std::numeric_limits<int>::max());
  visitor.flag({"prune", "", "keep only features that the image before showed as well"}, prune);
  visitor.real({"max_image_gap", "s", "after a longer pause the image before is not used for pruning"}, max_image_gap_s,
               0.001, 3600.0);
  visitor.real({"min_position_std", "m", "no pose claims to be more accurate than this"}, min_position_std_m, 0.0,
               1000.0);
  visitor.real({"min_yaw_std", "rad", "no heading claims to be more accurate than this"}, min_yaw_std_rad, 0.0, 3.2);
  visitor.integer(
      {"max_proposal_images", "1", "of a larger map a guided recovery weighs only so many images per image"},
      max_proposal_images, 1, std::numeric_limits<int>::max());
  match.declare(visitor);
  similarity.declare(visitor);
  hybrid.declare(visitor);
  fitness.declare(visitor);
  state.declare(visitor);
  dpso.declare(visitor);
  pf.declare(visitor);
}

std::vector<std::string> LocalizerConfig::violations() const {
  std::vector<std::string> wrong = rangeViolations(*this);
  for (const auto& violation : state.violations()) wrong.push_back(violation);
  for (const auto& violation : dpso.violations()) wrong.push_back(violation);
  return wrong;
}

}  // namespace visual_localization

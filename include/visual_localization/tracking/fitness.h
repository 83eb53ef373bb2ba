#pragma once

#include <cstddef>

#include <Eigen/Core>

#include "visual_localization/map/training_map.h"
#include "visual_localization/parameters/parameter_visitor.h"
#include "visual_localization/similarity/score_cache.h"

namespace visual_localization {

/// How fitness falls off beside the recorded path.
struct FitnessConfig {
  double distance_sigma_m = 10.0;  ///< std of zeta in Kronfeld et al. (journal), Eq. 3

  void declare(ParameterVisitor& visitor);
  std::vector<std::string> violations() const { return {}; }
};

/// f(x, t) and the training image it rests on.
struct Fitness {
  double value = 0.0;
  std::size_t training_image = 0;
  Score score;
};

/// f(x, t) = m(i_M(x), s(t)) * zeta(distance to i_M(x)), Kronfeld et al. (journal), Eq. 3, zeta a Gaussian of
/// height one; m as the weight that its similarity gives it.
Fitness evaluateFitness(const Eigen::Vector2d& position_m, const TrainingMap& map, ScoreCache& scores,
                        const FitnessConfig& config);

}  // namespace visual_localization

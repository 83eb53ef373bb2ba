#include "visual_localization/localization/tracker.h"

#include <cmath>

namespace visual_localization {

void FitnessConfig::declare(ParameterVisitor& visitor) {
  visitor.real({"fitness/distance_sigma", "m", "how fast fitness falls off beside the recorded path (std of zeta)"},
               distance_sigma_m, 0.1, 1000.0);
}

Fitness evaluateFitness(const Eigen::Vector2d& position_m, const TrainingMap& map, ScoreCache& scores,
                        const FitnessConfig& config) {
  const Neighbour nearest = map.nearest(position_m);
  const double offset = nearest.distance_m / config.distance_sigma_m;
  const Score score = scores[nearest.image];
  return {score.weight * std::exp(-0.5 * offset * offset), nearest.image, score};
}

}  // namespace visual_localization

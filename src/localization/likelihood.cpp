#include "visual_localization/localization/likelihood.h"

#include <cmath>

#include "localization/image_likelihood.h"

namespace visual_localization {

void FitnessConfig::declare(ParameterVisitor& visitor) {
  visitor.real({"fitness/distance_sigma", "m", "how fast fitness falls off beside the recorded path (std of zeta)"},
               distance_sigma_m, 0.1, 1000.0);
  visitor.choice({"fitness/sharpen", "",
                  "what the exponent of a similarity raises: the similarity alone, m^n * zeta, or its product with "
                  "zeta, as in Weiss et al. (section IV.A, step 3), (m * zeta)^n"},
                 sharpen, {"similarity", "product"});
}

void ImageLikelihood::configure(const LocalizerConfig& config) {
  const auto exponent = [&config](FeatureKind kind) {
    return config.fitness.sharpen == "product" ? config.similarity.exponent(kind, config.match) : 1.0;
  };
  distance_sigma_m_ = config.fitness.distance_sigma_m;
  local_exponent_ = exponent(FeatureKind::kLocal);
  global_exponent_ = exponent(FeatureKind::kGlobal);
}

Fitness ImageLikelihood::at(const Eigen::Vector2d& position_m) {
  const Neighbour nearest = sessions_.nearest(position_m);
  const double offset = nearest.distance_m / distance_sigma_m_;
  const Score score = scores_[nearest.image];
  const double exponent = scores_.kind() == FeatureKind::kGlobal ? global_exponent_ : local_exponent_;
  return {score.weight * std::exp(-0.5 * exponent * offset * offset), nearest.image, score};
}

PoseLikelihood::PoseLikelihood(const TrainingMap& map, const Eigen::Vector2d& verified_m,
                               const std::optional<Fitness>& seen)
    : map_(map), verified_m_(verified_m), nearest_(map.nearest(verified_m).image), seen_(seen) {}

Fitness PoseLikelihood::at(const Eigen::Vector2d& position_m) {
  constexpr double kSigma_m = 1.0;  // a cloud as wide as that of a place: the next image may have no pose
  const double value = std::exp(-0.5 * (position_m - verified_m_).squaredNorm() / (kSigma_m * kSigma_m));
  return {value, nearest_, {value, value, 0, true}};
}

std::vector<std::size_t> PoseLikelihood::mostSimilar(std::size_t count) {
  std::vector<std::size_t> images;
  for (const Neighbour& neighbour : map_.nearest(verified_m_, count)) images.push_back(neighbour.image);
  return images;
}

}  // namespace visual_localization

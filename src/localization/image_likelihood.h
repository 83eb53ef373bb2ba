#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "localization/session_choice.h"
#include "visual_localization/localization/likelihood.h"
#include "visual_localization/localization/localizer_config.h"
#include "visual_localization/localization/scores.h"

namespace visual_localization {

/// What the similarity to the training images says: f(x, t) = m(i_M(x), s(t)) * zeta(distance to i_M(x)), Kronfeld et
/// al. (journal), Eq. 3, zeta a Gaussian of height one; m as the weight that its similarity gives it.
class ImageLikelihood final : public Likelihood {
 public:
  /// All must outlive it. `sessions`: which training image stands for a position.
  ImageLikelihood(Scores& scores, MapSweep& sweep, const SessionChoice& sessions, const LocalizerConfig& config)
      : scores_(scores), sweep_(sweep), sessions_(sessions) {
    configure(config);
  }

  void configure(const LocalizerConfig& config);
  Fitness at(const Eigen::Vector2d& position_m) override;
  Score of(std::size_t training_image) override { return scores_[training_image]; }
  std::size_t draw(Random& random) override { return sweep_.draw(scores_, random); }
  std::vector<std::size_t> mostSimilar(std::size_t count) override { return sweep_.mostSimilar(scores_, count); }

 private:
  Scores& scores_;
  MapSweep& sweep_;
  const SessionChoice& sessions_;
  double distance_sigma_m_ = 1.0;
  double local_exponent_ = 1.0;  ///< of zeta, where particles are compared by local features
  double global_exponent_ = 1.0;
};

}  // namespace visual_localization

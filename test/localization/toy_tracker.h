#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "visual_localization/localization/tracker.h"

namespace visual_localization::test {

/// The smallest tracker that works: a grid of hypotheses about the best place of the image before. Knows nothing of
/// sessions, sweeps, odometry or verified poses.
class ToyTracker final : public Tracker {
 public:
  ToyTracker(const TrainingMap& map, const TrackerConfig&, std::uint32_t seed) : random_(seed) {
    reset(anywhere(map.area()));
  }

  void reset(const Prior& prior) override {
    particles_.resize(kHypotheses);
    for (Particle& particle : particles_) particle.position_m = prior(random_);
    belief_ = {};
  }

  void predict(const Motion&) override {
    if (!belief_.best.recognised) return;
    for (std::size_t i = 0; i < kHypotheses; ++i) {
      const double angle_rad = 2.399963 * static_cast<double>(i);  // the golden angle: a disc, filled evenly
      const double radius_m = 0.4 * std::sqrt(static_cast<double>(i));
      particles_[i].position_m =
          belief_.position_m + radius_m * Eigen::Vector2d(std::cos(angle_rad), std::sin(angle_rad));
    }
  }

  void update(Likelihood& likelihood) override {
    belief_.best = {};
    double most = -1.0;
    for (Particle& particle : particles_) {
      const Fitness fitness = likelihood.at(particle.position_m);
      particle.weight = fitness.value;
      if (fitness.value <= most) continue;
      most = fitness.value;
      belief_.position_m = particle.position_m;
      belief_.best = fitness.score;
      belief_.best_image = belief_.training_image = fitness.training_image;
    }
    normaliseWeights(particles_);
    belief_.mode_covariance_m2 = covarianceAbout(belief_.position_m, particles_);
    belief_.cloud_covariance_m2 = scatterAbout(belief_.position_m, particles_);
    belief_.spread_m = momentsOf(particles_).spread();
    belief_.report.set("hypotheses", kHypotheses);
  }

  const TrackerEstimate& belief() const override { return belief_; }
  bool configure(const TrackerConfig&) override { return true; }
  const std::vector<Particle>& particles() const override { return particles_; }

 private:
  static constexpr std::size_t kHypotheses = 60;

  Random random_;
  std::vector<Particle> particles_;
  TrackerEstimate belief_;
};

}  // namespace visual_localization::test

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "visual_localization/parameters/parameter_visitor.h"
#include "visual_localization/tracking/fitness.h"
#include "visual_localization/tracking/random.h"
#include "visual_localization/tracking/tracker.h"

namespace visual_localization {

/// Parameters of the dynamic particle swarm; names and defaults of Kronfeld et al. (journal), section 5.
struct DpsoConfig {
  int particles = 80;
  double inertia = 0.99;            ///< omega
  double phi0 = 0.3;                ///< weight of the random perturbation
  double phi2 = 0.6;                ///< weight of the attraction to the best particle
  double quantum_share = 0.10;      ///< q_r
  double quantum_std = 0.15;        ///< q_d, share of the area's range
  double high_energy_share = 0.10;  ///< h_r
  double high_energy_factor = 3.0;  ///< speed limit of high-energy particles, times v0
  double v0 = 0.015;                ///< speed limit, share of the area's range per image
  bool adapt_speed = true;          ///< follow the speed of the swarm with v0
  double v0_min = 0.002;            ///< speed adaptation never goes below
  double ema_alpha = 0.125;         ///< alpha of the moving average of the swarm's speed
  bool recover = true;              ///< boost diversity when the position is lost
  int recovery_patience = 2;        ///< bad images in a row before recovery starts
  double recovery_step = 0.5;       ///< share of the way to the limits per bad image
  double v0_max = 0.1;
  double quantum_share_max = 0.20;
  double phi2_min = 0.01;
  double mode_radius_m = 5.0;  ///< particles this close to the best one make up its mode

  void declare(ParameterVisitor& visitor);
  std::vector<std::string> violations() const;
};

/// Dynamic particle swarm optimisation, Kronfeld et al. (journal), section 5: particles fly towards the best
/// one of the last image; the best one is the estimate.
class Dpso final : public Tracker {
 public:
  /// `map` must outlive the tracker. Starts anywhere in the map's area.
  Dpso(const TrainingMap& map, const DpsoConfig& config, const FitnessConfig& fitness, std::uint32_t seed);

  void reset(const Prior& prior) override;
  TrackerEstimate update(ScoreCache& scores) override;
  const std::vector<Particle>& particles() const override { return particles_; }
  TrackerTuning tuning() const override { return tuning_; }

 private:
  void assignKinds();
  void move(Particle& particle);
  void moveQuantum(Particle& particle);
  std::size_t evaluate(ScoreCache& scores);
  TrackerEstimate estimate() const;
  void adaptSpeed();
  void adaptDiversity(const Score& best);
  Eigen::Vector2d centreOfMass() const;

  const TrainingMap& map_;
  DpsoConfig config_;
  FitnessConfig fitness_config_;
  Random random_;
  Area area_;
  TrackerTuning tuning_;
  std::vector<Particle> particles_;
  std::vector<Fitness> fitness_;
  std::optional<Eigen::Vector2d> attractor_m_;       ///< p^n: the best particle of the last image
  std::optional<Eigen::Vector2d> centre_of_mass_m_;  ///< after the last image
  bool seen_an_image_ = false;                       ///< since the last reset
  bool speed_known_ = false;
  int bad_images_ = 0;
};

}  // namespace visual_localization

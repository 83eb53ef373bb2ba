#pragma once

#include <string>

#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// How fitness falls off beside the recorded path.
struct FitnessConfig {
  double distance_sigma_m = 10.0;
  std::string sharpen = "similarity";

  void declare(ParameterVisitor& visitor);
};

/// Parameters of the dynamic particle swarm; names and defaults of Kronfeld et al. (journal), section 5.
struct DpsoConfig {
  int particles = 80;
  double inertia = 0.99;
  double phi0 = 0.3;
  double phi2 = 0.6;
  std::string confine = "box";
  double corridor_m = 20.0;  ///< from the nearest training image; no parameter
  std::string speed_limit = "axis";
  std::string speed_of = "moving";
  std::string position = "best";
  int best_particles = 5;  ///< of position k_best; no parameter
  double quantum_share = 0.10;
  double quantum_std = 0.15;
  double high_energy_share = 0.10;
  double high_energy_factor = 3.0;
  bool high_energy_perturbation = false;
  double v0 = 0.015;
  bool adapt_speed = true;
  double v0_min = 0.002;
  double v0_decrease = 0.9;
  double ema_alpha = 0.125;
  std::string ema_start = "first";
  std::string recovery = "guided";
  bool guided_start = true;
  int recovery_patience = 2;
  double recovery_step = 0.5;
  double v0_max = 0.1;
  double max_range_m = 500.0;
  double quantum_share_max = 0.20;
  double phi2_min = 0.01;
  double phi0_max = 0.0;
  double mode_radius_m = 5.0;  ///< particles this close to the best one make up its mode; no parameter
  static constexpr int kMostSwarms = 5;
  int swarms = 3;
  double exclusion_radius_m = 15.0;  ///< swarms this close to each other become one; no parameter
  double rival_share = 0.5;          ///< a rival must match so well in relation to the leader; no parameter

  void declare(ParameterVisitor& visitor);
};

/// Parameters of the particle filters; defaults of Weiss et al., section IV.A, and Kronfeld et al. (journal), Table 3.
struct ParticleFilterConfig {
  int particles = 300;
  std::string selection = "weights";
  double selection_floor = 0.5;
  std::string draws = "low_variance";
  std::string random_particles = "worst";
  double random_share = 0.05;
  double pull = 0.2;
  std::string confine = "none";
  std::string position = "mean";
  double gaussian_std_m = 4.0;
  double rotation_std_deg = 60.0;
  double acceleration_std = 0.001;
  double initial_speed_m = 1.8;
  std::string initial_speed_of = "metres";

  void declare(ParameterVisitor& visitor);
};

/// Parameters of the discrete Bayes filter over the training images.
struct BayesConfig {
  double anywhere = 0.02;
  double uniform = 0.03;        ///< share of the likelihood that is the same everywhere; no parameter
  int sure_comparisons = 20;    ///< of an image while the position is sure; no parameter, as the next two
  int comparisons = 60;         ///< while it is known
  int first_comparisons = 120;  ///< while it is not

  void declare(ParameterVisitor& visitor);
};

/// Which tracker, and the parameters of all of them.
struct TrackerConfig {
  std::string tracker = "dpso";
  DpsoConfig dpso;
  ParticleFilterConfig pf;
  BayesConfig bayes;
};

}  // namespace visual_localization

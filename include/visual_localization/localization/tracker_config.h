#pragma once

#include <cstddef>
#include <string>

#include "visual_localization/parameters/parameter_visitor.h"

namespace visual_localization {

/// How fitness falls off beside the recorded path.
struct FitnessConfig {
  double distance_sigma_m = 10.0;  ///< std of zeta in Kronfeld et al. (journal), Eq. 3

  void declare(ParameterVisitor& visitor);
};

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
  std::string recovery = "guided";  ///< what happens when the position is lost: "guided", "paper" or "none"
  bool guided_start = true;         ///< guided also while the position is unknown from the start
  int recovery_patience = 2;        ///< bad images in a row before recovery starts
  double recovery_step = 0.5;       ///< share of the way to the limits per bad image
  double v0_max = 0.1;
  double max_range_m = 500.0;  ///< shares of the area's range are of at most this: a city's swarm is not faster
  double quantum_share_max = 0.20;
  double phi2_min = 0.01;
  double mode_radius_m = 5.0;  ///< particles this close to the best one make up its mode

  void declare(ParameterVisitor& visitor);
};

/// Parameters of the particle filters; defaults of Weiss et al., section IV.A, and Kronfeld et al. (journal), Table 3.
struct ParticleFilterConfig {
  int particles = 300;              ///< m
  double pull = 0.2;                ///< share of the way to its nearest training image that a particle is moved
  double random_share = 0.05;       ///< worst particles that are replaced by random ones after each image
  double gaussian_std_m = 4.0;      ///< step of pf_gaussian per image and axis
  double rotation_std_deg = 60.0;   ///< sigma_rot of pf_linear
  double acceleration_std = 0.001;  ///< sigma_acc of pf_linear
  double initial_speed_m = 1.8;     ///< v_init of pf_linear per image: three times the papers' 0.6 m

  void declare(ParameterVisitor& visitor);
};

/// Which tracker, and the parameters of all of them.
struct TrackerConfig {
  std::string tracker = "dpso";  ///< "dpso", "pf_gaussian" or "pf_linear"
  DpsoConfig dpso;
  ParticleFilterConfig pf;
  FitnessConfig fitness;

  /// Number of particles of the chosen tracker.
  std::size_t particles() const { return static_cast<std::size_t>(tracker == "dpso" ? dpso.particles : pf.particles); }
};

}  // namespace visual_localization

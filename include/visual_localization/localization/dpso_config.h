#pragma once

#include <string>
#include <vector>

#include "visual_localization/parameters/parameter_visitor.h"

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
  std::string recovery = "guided";  ///< what happens when the position is lost: "guided", "paper" or "none"
  bool guided_start = true;         ///< guided also while the position is unknown from the start
  int recovery_patience = 2;        ///< bad images in a row before recovery starts
  double recovery_step = 0.5;       ///< share of the way to the limits per bad image
  double v0_max = 0.1;
  double max_range_m = 500.0;  ///< shares of the area's range are of at most so much: a city's swarm is not faster
  double quantum_share_max = 0.20;
  double phi2_min = 0.01;
  double mode_radius_m = 5.0;  ///< particles this close to the best one make up its mode

  void declare(ParameterVisitor& visitor);
  std::vector<std::string> violations() const;
};

}  // namespace visual_localization

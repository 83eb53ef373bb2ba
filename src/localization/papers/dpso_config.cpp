#include "visual_localization/localization/tracker_config.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

void DpsoConfig::declare(ParameterVisitor& visitor) {
  visitor.integer({"dpso/particles", "1", "size of the swarm"}, particles, 2, 100000);
  visitor.real({"dpso/inertia", "1", "share of the velocity that is kept (omega)"}, inertia, 0.0, 1.0);
  visitor.real({"dpso/phi0", "1", "weight of the random perturbation"}, phi0, 0.0, 10.0);
  visitor.real({"dpso/phi2", "1", "weight of the attraction to the best particle"}, phi2, 0.0, 4.0);
  visitor.choice({"dpso/confine", "",
                  "where particles may be: anywhere, as in the papers (none), in the bounding box of the training "
                  "images, stopped at its border (box) or turned back there (reflect), or within 20 m of an image "
                  "(corridor)"},
                 confine, {"none", "box", "reflect", "corridor"});
  visitor.choice({"dpso/speed_limit", "",
                  "what is limited: the speed along each axis, or its norm, as in the papers, with each axis in shares "
                  "of its range (norm) or in shares of the area's diagonal (diagonal)"},
                 speed_limit, {"axis", "norm", "diagonal"});
  visitor.choice({"dpso/speed_of", "",
                  "what tells the speed of the swarm (v_sw): the centre of mass of all particles, as in the papers, or "
                  "without those that do not travel, the quantum particles (moving); or the length of the averaged "
                  "mean velocity of the standard particles (velocity)"},
                 speed_of, {"moving", "all", "velocity"});
  visitor.choice({"dpso/position", "",
                  "estimate: the best particle, the centre of the best five, or the weighted centre of the swarm "
                  "(conference paper, section V)"},
                 position, {"best", "k_best", "centre"});
  visitor.real({"dpso/quantum_share", "1", "share of quantum particles (q_r)"}, quantum_share, 0.0, 1.0);
  visitor.real({"dpso/quantum_std", "1", "spread of quantum particles, share of the area's range (q_d)"}, quantum_std,
               0.0, 1.0);
  visitor.real({"dpso/high_energy_share", "1", "share of particles allowed a higher speed (h_r)"}, high_energy_share,
               0.0, 1.0);
  visitor.real({"dpso/high_energy_factor", "1", "their speed limit in multiples of v0"}, high_energy_factor, 1.0,
               100.0);
  visitor.flag({"dpso/high_energy_perturbation", "", "their random perturbation is as many times as large"},
               high_energy_perturbation);
  visitor.real({"dpso/v0", "1", "initial speed limit per image, share of the area's range"}, v0, 1e-6, 1.0);
  visitor.flag({"dpso/adapt_speed", "", "keep v0 at about twice the speed of the swarm"}, adapt_speed);
  visitor.real({"dpso/v0_min", "1", "lower limit of the speed adaptation"}, v0_min, 1e-6, 1.0);
  visitor.real({"dpso/v0_decrease", "1", "what v0 is multiplied by where the swarm is slow"}, v0_decrease, 0.1, 1.0);
  visitor.real({"dpso/ema_alpha", "1", "weight of the newest speed in its moving average (alpha)"}, ema_alpha, 0.001,
               1.0);
  visitor.choice({"dpso/ema_start", "",
                  "the average begins with the first speed, or with a weight of 2 / (n + 1) for the n-th (growing)"},
                 ema_start, {"first", "growing"});
  visitor.choice({"recovery", "",
                  "when the swarm is lost: search where the image looks alike, widen as in the papers, "
                  "or nothing"},
                 recovery, {"guided", "paper", "none"});
  visitor.flag({"dpso/guided_start", "", "guided also while the position is unknown from the start"}, guided_start);
  visitor.integer({"dpso/recovery_patience", "1", "bad images in a row before recovery starts"}, recovery_patience, 1,
                  1000);
  visitor.real({"dpso/recovery_step", "1", "share of the way to the limits taken per bad image"}, recovery_step, 0.01,
               1.0);
  visitor.real({"dpso/v0_max", "1", "speed limit in recovery and of the speed adaptation"}, v0_max, 1e-6, 1.0);
  visitor.real({"dpso/max_range", "m", "largest range of a map that shares of the range refer to"}, max_range_m, 1.0,
               100000.0);
  visitor.real({"dpso/quantum_share_max", "1", "share of quantum particles in recovery"}, quantum_share_max, 0.0, 1.0);
  visitor.real({"dpso/phi2_min", "1", "attraction of the best particle in recovery"}, phi2_min, 0.0, 4.0);
  visitor.real(
      {"dpso/phi0_max", "1",
       "random perturbation in recovery, as in the conference paper; up to phi0: not raised, as in the journal"},
      phi0_max, 0.0, 10.0);
  visitor.integer({"dpso/swarms", "1", "dpso_multi: swarms at most, which share the particles"}, swarms, 2,
                  kMostSwarms);
  visitor.atMost("dpso/v0_min", v0_min, "dpso/v0", v0);
  visitor.atMost("dpso/v0", v0, "dpso/v0_max", v0_max);
  visitor.atMost("dpso/quantum_share", quantum_share, "dpso/quantum_share_max", quantum_share_max);
  visitor.atMost("dpso/phi2_min", phi2_min, "dpso/phi2", phi2);
  // Not by the difference: 1 - 0.9 is less than 0.1.
  visitor.require(quantum_share_max + high_energy_share <= 1.0, "dpso/quantum_share_max",
                  parameters::toString(quantum_share_max),
                  "at most 1 - 'dpso/high_energy_share' = " + parameters::toString(1.0 - high_energy_share));
}

}  // namespace visual_localization

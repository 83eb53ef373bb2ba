#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "visual_localization/localization/particles.h"
#include "visual_localization/localization/tracker.h"

namespace visual_localization {

/// How the swarm is tuned at the moment.
struct SwarmTuning {
  double v0 = 0.0;             ///< speed limit, share of the area's range per image
  double speed_ema = 0.0;      ///< smoothed speed of the swarm, same unit
  double quantum_share = 0.0;  ///< share of quantum particles
  double phi2 = 0.0;           ///< attraction of the best particle
  double phi0 = 0.0;           ///< random perturbation
  bool recovering = false;     ///< the position is taken to be lost
  double speed_mps = 0.0;      ///< smoothed speed of the swarm (v_sw), metres per second; 0: not known yet
};

/// Dynamic particle swarm optimisation, Kronfeld et al. (journal), section 5: particles fly towards the best
/// one of the last image; the best one is the estimate.
class Dpso final : public Tracker {
 public:
  /// `map` must outlive the tracker. Starts anywhere in the map's area.
  Dpso(const TrainingMap& map, const DpsoConfig& config, std::uint32_t seed);
  Dpso(const TrainingMap& map, const TrackerConfig& config, std::uint32_t seed) : Dpso(map, config.dpso, seed) {}

  void reset(const Prior& prior) override;
  /// What has adapted itself to the images stays, unless just that was changed.
  bool configure(const TrackerConfig& config) override;
  /// Odometry carries a share of the swarm along.
  void predict(const Motion& motion) override;
  /// The swarm flies once an image, then weighs what it finds there.
  void update(Likelihood& likelihood) override;
  const TrackerEstimate& belief() const override { return belief_; }
  const std::vector<Particle>& particles() const override { return particles_; }
  const SwarmTuning& tuning() const { return tuning_; }
  /// As configure(), whatever the number of particles is.
  void configure(const DpsoConfig& config);
  /// Fewer particles, or copies of those that are there.
  void resize(std::size_t particles);
  /// Where the particles of the next images must not be: discs of this radius about other swarms' places.
  void exclude(const std::vector<Eigen::Vector2d>& places_m, double radius_m);

 private:
  /// What parameters choose. Each particle needs it, and comparing their texts takes longer.
  struct Choices {
    explicit Choices(const DpsoConfig& config)
        : in_box(config.confine == "box" || config.confine == "reflect"),
          reflects(config.confine == "reflect"),
          in_corridor(config.confine == "corridor"),
          limit_of_axis(config.speed_limit == "axis"),
          by_diagonal(config.speed_limit == "diagonal"),
          speed_of_moving(config.speed_of == "moving"),
          speed_of_velocity(config.speed_of == "velocity"),
          guided(config.recovery == "guided") {}

    bool in_box;
    bool reflects;
    bool in_corridor;
    bool limit_of_axis;
    bool by_diagonal;
    bool speed_of_moving;
    bool speed_of_velocity;
    bool guided;
  };

  void assignKinds();
  void confine(Particle& particle) const;
  void keepOut(Particle& particle) const;
  void fly(Likelihood& likelihood);
  void move(Particle& particle);
  Eigen::Vector2d limited(const Eigen::Vector2d& velocity_m, double limit) const;
  double relativeLength(const Eigen::Vector2d& displacement_m) const;
  void moveQuantum(Particle& particle);
  bool isGuided() const;
  void weigh(Likelihood& likelihood);
  void found(const Eigen::Vector2d& position_m);
  TrackerEstimate estimate() const;
  Eigen::Vector2d positionOf_m(const CloudMoments& cloud) const;
  Eigen::Vector2d centreOfBest_m() const;
  void adapt();
  void adaptSpeed();
  void adaptDiversity();
  void endRecovery();
  void report();
  Eigen::Vector2d centreOfMass() const;
  Eigen::Vector2d meanVelocity_m() const;
  double newestShare() const;
  void learnSpeed();
  /// What speeds and the reach of quantum particles are shares of.
  Eigen::Vector2d range_m() const { return area_.range().cwiseMin(config_.max_range_m); }

  const TrainingMap& map_;
  DpsoConfig config_;
  Choices choices_{config_};
  Random random_;
  Area area_;
  SwarmTuning tuning_;
  TrackerEstimate belief_;
  std::vector<Particle> particles_;
  std::vector<Fitness> fitness_;
  Fitness best_;                                     ///< the most similar one of the last image
  double seconds_ = 0.0;                             ///< up to the image; 0: unknown
  bool is_new_ = false;                              ///< the swarm has not flown for the image yet
  std::optional<Eigen::Vector2d> attractor_m_;       ///< p^n: the best particle of the last image
  std::optional<Eigen::Vector2d> centre_of_mass_m_;  ///< after the last image, shifted by the odometry since
  /// The same at the last image of another time, not shifted.
  std::optional<Eigen::Vector2d> last_centre_m_;
  bool seen_an_image_ = false;                                ///< since the last reset
  Eigen::Vector2d velocity_ema_m_ = Eigen::Vector2d::Zero();  ///< of the swarm, metres per image
  int speeds_known_ = 0;                                      ///< images that the average rests on
  bool ground_speed_known_ = false;
  bool position_unknown_ = true;  ///< nothing was recognised since a reset without a prior
  int bad_images_ = 0;
  std::vector<Eigen::Vector2d> excluded_m_;
  double exclusion_radius_m_ = 0.0;
};

}  // namespace visual_localization

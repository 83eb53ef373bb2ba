#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "visual_localization/localization/particles.h"
#include "visual_localization/localization/tracker.h"

namespace visual_localization {

/// Dynamic particle swarm optimisation, Kronfeld et al. (journal), section 5: particles fly towards the best
/// one of the last image; the best one is the estimate.
class Dpso final : public Tracker {
 public:
  /// `map` must outlive the tracker. Starts anywhere in the map's area.
  Dpso(const TrainingMap& map, const DpsoConfig& config, const FitnessConfig& fitness, std::uint32_t seed,
       const OdometryConfig& odometry = {});

  void reset() override;
  void reset(const Prior& prior) override;
  /// What has adapted itself to the images stays, unless just that was changed.
  void configure(const TrackerConfig& config) override;
  TrackerEstimate update(const TrackerInput& input) override;
  void attract(const Eigen::Vector2d& position_m) override;
  const std::vector<Particle>& particles() const override { return particles_; }
  TrackerTuning tuning() const override { return tuning_; }
  /// Fewer particles, or copies of those that are there.
  void resize(std::size_t particles);
  /// Where the particles of the next images must not be: discs of this radius about other swarms' places.
  void exclude(const std::vector<Eigen::Vector2d>& places_m, double radius_m);

 private:
  /// What parameters choose. Each particle needs it, and comparing their texts takes longer.
  struct Choices {
    explicit Choices(const DpsoConfig& config)
        : in_box(config.confine == "box"),
          in_corridor(config.confine != "box" && config.confine != "none"),
          limit_of_axis(config.speed_limit == "axis"),
          speed_of_moving(config.speed_of == "moving"),
          guided(config.recovery == "guided") {}

    bool in_box;
    bool in_corridor;
    bool limit_of_axis;
    bool speed_of_moving;
    bool guided;
  };

  void assignKinds();
  void confine(Particle& particle) const;
  void keepOut(Particle& particle) const;
  void shift(const OdometryIncrement& odometry);
  void move(Particle& particle);
  Eigen::Vector2d limited(const Eigen::Vector2d& velocity_m, double limit) const;
  void moveQuantum(Particle& particle);
  bool isGuided() const;
  std::size_t evaluate(const TrackerInput& input);
  TrackerEstimate estimate() const;
  Eigen::Vector2d positionOf_m(const CloudMoments& cloud) const;
  Eigen::Vector2d centreOfBest_m() const;
  void adaptSpeed(const Travel& travel);
  void adaptDiversity(const Score& best);
  void endRecovery();
  Eigen::Vector2d centreOfMass() const;
  /// What speeds and the reach of quantum particles are shares of.
  Eigen::Vector2d range_m() const { return area_.range().cwiseMin(config_.max_range_m); }

  const TrainingMap& map_;
  DpsoConfig config_;
  Choices choices_{config_};
  FitnessConfig fitness_config_;
  OdometryConfig odometry_config_;
  Random random_;
  Area area_;
  TrackerTuning tuning_;
  std::vector<Particle> particles_;
  std::vector<Fitness> fitness_;
  std::optional<Eigen::Vector2d> attractor_m_;       ///< p^n: the best particle of the last image
  std::optional<Eigen::Vector2d> centre_of_mass_m_;  ///< after the last image, shifted by the odometry since
  /// The same at the last image of another time, not shifted.
  std::optional<Eigen::Vector2d> last_centre_m_;
  bool seen_an_image_ = false;  ///< since the last reset
  bool speed_known_ = false;
  bool ground_speed_known_ = false;
  bool position_unknown_ = true;  ///< nothing was recognised since a reset without a prior
  int bad_images_ = 0;
  std::vector<Eigen::Vector2d> excluded_m_;
  double exclusion_radius_m_ = 0.0;
};

}  // namespace visual_localization

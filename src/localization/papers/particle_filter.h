#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/localization/particles.h"
#include "visual_localization/localization/tracker.h"
#include "visual_localization/map/training_map.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// How a particle may move from one image to the next.
class MotionModel {
 public:
  virtual ~MotionModel() = default;
  /// Gives a particle at a new position whatever the model needs.
  virtual void start(Particle&, Random&) const {}
  /// One image further.
  virtual void move(Particle& particle, const Motion& motion, Random& random) const = 0;
};

/// Random walk (Weiss et al., section IV.A; PF-g of Kronfeld et al. (journal), section 7.2).
class GaussianMotion final : public MotionModel {
 public:
  /// `std_m`: of the step along each axis, metres per image.
  explicit GaussianMotion(double std_m) : std_m_(std_m) {}
  void move(Particle& particle, const Motion& motion, Random& random) const override;

 private:
  double std_m_;
};

/// Straight on with a disturbed velocity (PF-l of Kronfeld et al. (journal), Eq. 7 and 8).
class LinearMotion final : public MotionModel {
 public:
  /// `rotation_std_rad`: sigma_rot; `acceleration_std`: sigma_acc, of the logarithm of the speed;
  /// `initial_speed_m`: v_init of each axis, metres per image, in a random direction.
  LinearMotion(double rotation_std_rad, double acceleration_std, const Eigen::Vector2d& initial_speed_m)
      : rotation_std_rad_(rotation_std_rad), acceleration_std_(acceleration_std), initial_speed_m_(initial_speed_m) {}
  void start(Particle& particle, Random& random) const override;
  void move(Particle& particle, const Motion& motion, Random& random) const override;

 private:
  double rotation_std_rad_;
  double acceleration_std_;
  Eigen::Vector2d initial_speed_m_;
};

/// Moves a particle a share of the way to its nearest training image (Weiss et al., section IV.A, step 2).
class PullToMap final : public MotionModel {
 public:
  /// `map` must outlive the model; `share` in [0, 1].
  PullToMap(const TrainingMap& map, double share) : map_(map), share_(share) {}
  void move(Particle& particle, const Motion& motion, Random& random) const override;

 private:
  const TrainingMap& map_;
  double share_;
};

/// Puts a particle that left the area on its border.
class StayInArea final : public MotionModel {
 public:
  explicit StayInArea(const Area& area) : area_(area) {}
  void move(Particle& particle, const Motion& motion, Random& random) const override;

 private:
  Area area_;
};

/// By odometry where there is any, along the direction of the nearest training image; otherwise as another model.
class OdometryMotion final : public MotionModel {
 public:
  /// `map` must outlive the model.
  OdometryMotion(const TrainingMap& map, std::unique_ptr<MotionModel> otherwise)
      : map_(map), otherwise_(std::move(otherwise)) {}
  void start(Particle& particle, Random& random) const override { otherwise_->start(particle, random); }
  void move(Particle& particle, const Motion& motion, Random& random) const override;

 private:
  const TrainingMap& map_;
  std::unique_ptr<MotionModel> otherwise_;
};

/// Several models, one after the other.
class CombinedMotion final : public MotionModel {
 public:
  explicit CombinedMotion(std::vector<std::unique_ptr<MotionModel>> parts);
  void start(Particle& particle, Random& random) const override;
  void move(Particle& particle, const Motion& motion, Random& random) const override;

 private:
  std::vector<std::unique_ptr<MotionModel>> parts_;
};

/// The motion of the tracker called `tracker`, "pf_gaussian" or "pf_linear", with the pull towards the training images.
/// `map` must outlive it.
std::unique_ptr<MotionModel> makeMotionModel(const std::string& tracker, const ParticleFilterConfig& config,
                                             const TrainingMap& map);

/// Particle filter without odometry (Weiss et al., section IV.A): resample, move, weigh, estimate the weighted
/// mean, replace the worst by random particles. How the toolkit of the authors of Kronfeld et al. selects is a
/// parameter each.
class ParticleFilter final : public Tracker {
 public:
  /// `map` must outlive the filter. Starts anywhere in the map's area.
  ParticleFilter(const TrainingMap& map, const TrackerConfig& config, std::uint32_t seed);
  ParticleFilter(const TrainingMap& map, std::unique_ptr<MotionModel> motion, const ParticleFilterConfig& config,
                 std::uint32_t seed);

  void reset(const Prior& prior) override;
  bool configure(const TrackerConfig& config) override;
  void predict(const Motion& motion) override;
  void update(Likelihood& likelihood) override;
  const TrackerEstimate& belief() const override { return belief_; }
  const std::vector<Particle>& particles() const override { return particles_; }

 private:
  void select();
  void scaleWeights();
  void drawEvenly(std::size_t count);
  void drawIndependently(std::size_t count);
  void weigh(Likelihood& likelihood);
  TrackerEstimate estimate() const;
  std::size_t randomCount() const;
  void makeRandom(Particle& particle);
  void replaceWorst();

  const TrainingMap& map_;
  std::unique_ptr<MotionModel> motion_;
  ParticleFilterConfig config_;
  Random random_;
  Prior anywhere_;
  std::vector<Particle> particles_;
  std::vector<Particle> drawn_;     ///< of the last resampling; kept to save the allocation
  std::vector<double> cumulated_;   ///< weights up to and including each particle; kept likewise
  std::vector<std::size_t> order_;  ///< of the particles by weight
  Fitness best_;                    ///< of the last image
  bool is_new_ = true;              ///< nothing is known of the image yet, or there was none
  TrackerEstimate belief_;
};

}  // namespace visual_localization

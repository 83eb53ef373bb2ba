#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "visual_localization/localization/particles.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// How a particle may move from one image to the next.
class MotionModel {
 public:
  virtual ~MotionModel() = default;
  /// Gives a particle at a new position whatever the model needs.
  virtual void start(Particle&, Random&) const {}
  /// One image further.
  virtual void move(Particle& particle, const Travel& travel, Random& random) const = 0;
};

/// Random walk (Weiss et al., section IV.A; PF-g of Kronfeld et al. (journal), section 7.2).
class GaussianMotion final : public MotionModel {
 public:
  /// `std_m`: of the step along each axis, metres per image.
  explicit GaussianMotion(double std_m) : std_m_(std_m) {}
  void move(Particle& particle, const Travel& travel, Random& random) const override;

 private:
  double std_m_;
};

/// Straight on with a disturbed velocity (PF-l of Kronfeld et al. (journal), Eq. 7 and 8).
class LinearMotion final : public MotionModel {
 public:
  /// `rotation_std_rad`: sigma_rot; `acceleration_std`: sigma_acc, of the logarithm of the speed;
  /// `initial_speed_m`: v_init, metres per image, in a random direction.
  LinearMotion(double rotation_std_rad, double acceleration_std, double initial_speed_m)
      : rotation_std_rad_(rotation_std_rad), acceleration_std_(acceleration_std), initial_speed_m_(initial_speed_m) {}
  void start(Particle& particle, Random& random) const override;
  void move(Particle& particle, const Travel& travel, Random& random) const override;

 private:
  double rotation_std_rad_;
  double acceleration_std_;
  double initial_speed_m_;
};

/// Moves a particle a share of the way to its nearest training image (Weiss et al., section IV.A, step 2).
class PullToMap final : public MotionModel {
 public:
  /// `map` must outlive the model; `share` in [0, 1].
  PullToMap(const TrainingMap& map, double share) : map_(map), share_(share) {}
  void move(Particle& particle, const Travel& travel, Random& random) const override;

 private:
  const TrainingMap& map_;
  double share_;
};

/// By odometry where there is any, along the direction of the nearest training image; otherwise as another model.
class OdometryMotion final : public MotionModel {
 public:
  /// `map` must outlive the model.
  OdometryMotion(const TrainingMap& map, const OdometryConfig& config, std::unique_ptr<MotionModel> otherwise)
      : map_(map), config_(config), otherwise_(std::move(otherwise)) {}
  void start(Particle& particle, Random& random) const override { otherwise_->start(particle, random); }
  void move(Particle& particle, const Travel& travel, Random& random) const override;

 private:
  const TrainingMap& map_;
  OdometryConfig config_;
  std::unique_ptr<MotionModel> otherwise_;
};

/// The way of a robot at `position_m` that looks where the nearest training image does, in the map frame, metres.
Eigen::Vector2d wayInMap(const TrainingMap& map, const Eigen::Vector2d& position_m, const OdometryIncrement& odometry);

/// Several models, one after the other.
class CombinedMotion final : public MotionModel {
 public:
  explicit CombinedMotion(std::vector<std::unique_ptr<MotionModel>> parts);
  void start(Particle& particle, Random& random) const override;
  void move(Particle& particle, const Travel& travel, Random& random) const override;

 private:
  std::vector<std::unique_ptr<MotionModel>> parts_;
};

}  // namespace visual_localization

#pragma once

#include <memory>

#include "visual_localization/parameters/parameter_visitor.h"
#include "visual_localization/tracking/particle.h"
#include "visual_localization/tracking/random.h"

namespace visual_localization {

/// How a particle may move from one image to the next. A model that knows odometry would take its increment
/// between `start` and `move`; these two do without.
class MotionModel {
 public:
  virtual ~MotionModel() = default;
  /// Gives a particle at a new place whatever the model needs.
  virtual void start(Particle& particle, Random& random) const = 0;
  /// One image further.
  virtual void move(Particle& particle, Random& random) const = 0;
};

/// Random walk (Weiss et al., section IV.A; PF-g of Kronfeld et al. (journal), section 7.2).
class GaussianMotion final : public MotionModel {
 public:
  /// `std_m`: of the step along each axis, metres per image.
  explicit GaussianMotion(double std_m) : std_m_(std_m) {}
  void start(Particle& particle, Random& random) const override;
  void move(Particle& particle, Random& random) const override;

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
  void move(Particle& particle, Random& random) const override;

 private:
  double rotation_std_rad_;
  double acceleration_std_;
  double initial_speed_m_;
};

}  // namespace visual_localization

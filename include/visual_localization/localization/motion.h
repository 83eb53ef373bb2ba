#pragma once

#include <optional>

#include <Eigen/Core>

#include "visual_localization/localization/odometry.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

class Random;

/// What is known of the robot's motion since the last image. Without odometry share and displacement are zero.
class Motion {
 public:
  /// Nothing is known.
  Motion() = default;
  /// `seconds` since the last image, 0: unknown; `config`: how far `odometry` is believed.
  explicit Motion(double seconds, const std::optional<OdometryIncrement>& odometry = {},
                  const OdometryConfig& config = {});

  double seconds() const { return seconds_; }
  /// By odometry; zero without it.
  const OdometryIncrement& increment() const { return increment_; }
  /// Standard deviation of the increment, metres.
  double sigma_m() const { return sigma_m_; }
  /// Share of the hypotheses that follow odometry; 0 without it. The others find out if it is wrong.
  double share() const { return share_; }
  /// Draws whether one hypothesis is among that share.
  bool carries(Random& random) const;
  /// Of a robot at `position_m` that looks where the nearest training image does, in the map frame, metres.
  Eigen::Vector2d displacementAt(const TrainingMap& map, const Eigen::Vector2d& position_m) const;

 private:
  double seconds_ = 0.0;
  OdometryIncrement increment_;
  double sigma_m_ = 0.0;
  double share_ = 0.0;
};

}  // namespace visual_localization

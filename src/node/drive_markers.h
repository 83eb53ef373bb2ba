#pragma once

#include <cstddef>
#include <deque>
#include <optional>

#include <Eigen/Core>
#include <std_msgs/Header.h>
#include <visualization_msgs/MarkerArray.h>

#include "visual_localization/localization/estimate.h"

namespace visual_localization {

/// The drive as rviz shows it, in the colours of the states: the robot, an outline of three standard deviations, state
/// and reason in words, and the way, thick where confirmed and thin where not, with no line where the position jumped.
/// Not thread-safe.
class DriveMarkers {
 public:
  static constexpr double kJump_m = 10.0;

  void add(const Estimate& estimate);
  /// Without an image: the robot stays where it was last seen.
  void stateIs(LocalizationState state, const Why& why);
  void clear() { way_.clear(); }
  /// `header`: map frame. Empty before the first estimate.
  visualization_msgs::MarkerArray toMarkers(const std_msgs::Header& header) const;

 private:
  struct Passed {
    Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
    LocalizationState state = LocalizationState::kInitializing;
  };

  std::deque<Passed> way_;  ///< oldest first
  std::optional<Estimate> last_;
};

}  // namespace visual_localization

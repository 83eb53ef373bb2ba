#pragma once

#include <cstddef>
#include <deque>

#include <geometry_msgs/PoseStamped.h>
#include <nav_msgs/Path.h>
#include <std_msgs/Header.h>

#include "visual_localization/localization/estimate.h"

namespace visual_localization {

/// Where the robot drove, as far as it was tracked. Not thread-safe.
class DrivenPath {
 public:
  static constexpr std::size_t kMost = 5000;  ///< poses that are remembered: the last ones
  static constexpr double kStep_m = 0.2;      ///< a pose nearer to the one before is left out

  /// A pose of the state TRACKING; where landmarks are used a metric one. No other changes anything. `header`: map
  /// frame, stamp of the image.
  void add(const Estimate& estimate, const std_msgs::Header& header);
  void clear() { poses_.clear(); }
  nav_msgs::Path toPath(const std_msgs::Header& header) const;

 private:
  std::deque<geometry_msgs::PoseStamped> poses_;  ///< oldest first
};

}  // namespace visual_localization

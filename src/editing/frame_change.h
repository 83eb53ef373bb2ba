#pragma once

#include <Eigen/Core>

#include "geometry/pose_corrections.h"
#include "visual_localization/geo/local_frame.h"

namespace visual_localization {

/// From the frame of one map to that of another. Both are flat, so that it is not the same everywhere.
class FrameChange {
 public:
  FrameChange(const LocalFrame& from, const LocalFrame& to);

  /// Of what is at this position, east and north in the first frame.
  PoseCorrection at(const Eigen::Vector2d& position_m) const;

 private:
  LocalFrame from_;
  LocalFrame to_;
  bool same_;
};

}  // namespace visual_localization

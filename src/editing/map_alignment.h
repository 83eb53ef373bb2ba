#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "geometry/pose_corrections.h"
#include "visual_localization/base/progress.h"
#include "visual_localization/geo/trajectory.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// Both frames are flat, so that the change depends on the position.
class FrameChange {
 public:
  FrameChange(const LocalFrame& from, const LocalFrame& to);

  /// East and north in the first frame.
  PoseCorrection at(const Eigen::Vector2d& position_m) const;

 private:
  LocalFrame from_;
  LocalFrame to_;
  bool same_;
};

/// A map whose images lie in the frame of the new map already.
struct PlacedMap {
  std::shared_ptr<const TrainingMap> map;
  std::vector<PoseCorrection> corrections;  ///< of each image, from the map's own frame
};

/// How the images of a map come to lie beside those of the maps before it.
struct MapAlignment {
  using Covariance = Eigen::Matrix<double, 6, 6>;

  std::vector<PoseCorrection> corrections;             ///< of each image, from the map's own frame
  std::vector<std::optional<Covariance>> covariances;  ///< of each image's pose where another map decides it
  std::size_t tied = 0;                                ///< images that landmarks of the maps before agree on
  double apart_m = 0.0;  ///< horizontal distance from where these see it: median before the alignment
  double left_m = 0.0;   ///< and after it
};

/// Lays `map` beside the `placed` ones, which stay, in `frame`: images near one of theirs are located by their
/// landmarks, and between these the map's own geometry holds. Where fewer than kLeastTied images overlap it lies where
/// its own fixes have it. The result does not depend on the number of threads.
MapAlignment align(const TrainingMap& map, const LocalFrame& frame, const std::vector<PlacedMap>& placed,
                   std::size_t threads, const Progress& progress = {});

constexpr std::size_t kLeastTied = 5;

}  // namespace visual_localization

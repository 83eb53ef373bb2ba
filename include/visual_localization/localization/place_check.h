#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/localization/scores.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// A second witness beside the tracker's own comparisons: the whole image should look at least as much like the
/// training images around the estimate as like any other of the map. A swarm that has settled at the wrong place
/// compares only what is there, and never sees that another place fits better.
class PlaceCheck {
 public:
  /// Of a map with more than `max_images` every k-th image is looked at, beginning with another one each time, but not
  /// with more of them than can be kept in memory.
  PlaceCheck(const TrainingMap& map, std::size_t max_images, double near_m);

  /// Other numbers of images and distance.
  void configure(std::size_t max_images, double near_m);
  /// Best global similarity within `near_m` of `position_m`, as a share of the best in the whole map, in [0, 1]. One
  /// when nothing looks alike anywhere.
  double ratio(ComparableImage& image, const Eigen::Vector2d& position_m);

 private:
  const TrainingMap& map_;
  std::vector<Neighbour> neighbours_;  ///< of the last position
  double near_m_ = 0.0;
  std::size_t stride_ = 1;
  std::size_t rounds_ = 1;  ///< after so many times it begins with the same training image again
  std::size_t round_ = 0;
};

}  // namespace visual_localization

#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/map/nearest_grid.h"

namespace visual_localization {

/// A training image and how far it is from the place asked about.
struct Neighbour {
  std::size_t image = 0;
  double distance_m = 0.0;
};

/// Finds the nearest of many positions: a k-d tree, and for small maps a grid. Of equally distant positions the one
/// with the lower index comes first, so that the answer does not depend on how the tree was split.
class PositionIndex {
 public:
  /// `positions_m`: finite, at least one; throws std::invalid_argument otherwise.
  explicit PositionIndex(std::vector<Eigen::Vector2d> positions_m);
  ~PositionIndex();
  PositionIndex(const PositionIndex&) = delete;
  PositionIndex& operator=(const PositionIndex&) = delete;

  /// The nearest. Throws std::invalid_argument when `position_m` is not finite.
  Neighbour nearest(const Eigen::Vector2d& position_m) const;
  /// Into `found`: the `count` nearest, closest first; fewer when there are fewer. A position that is not finite has
  /// none.
  void nearest(const Eigen::Vector2d& position_m, std::size_t count, std::vector<Neighbour>& found) const;

 private:
  class Tree;
  std::unique_ptr<Tree> tree_;
  std::unique_ptr<const NearestGrid> grid_;  ///< of small maps
};

}  // namespace visual_localization

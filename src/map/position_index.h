#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// Finds the nearest of many positions: a k-d tree. Of equally distant positions the one
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
  /// Into `found`: the `count` nearest, closest first; fewer when there are fewer, and of exactly one spot the first
  /// 1024 at most. A position that is not finite has none.
  void nearest(const Eigen::Vector2d& position_m, std::size_t count, std::vector<Neighbour>& found) const;

  /// Into `found`: all within `radius_m`, in order of index. A position that is not finite has none.
  void within(const Eigen::Vector2d& position_m, double radius_m, std::vector<std::uint32_t>& found) const;

  /// How far a search among the nearest positions goes.
  struct Search {
    std::size_t wanted = 1;                                     ///< so many that are accepted are enough
    std::size_t count = 1;                                      ///< positions that are looked at, at least
    double radius_m = std::numeric_limits<double>::infinity();  ///< and none farther away
  };
  /// Into `found`: of the `search.count` nearest those within the radius that `accept` takes, closest first. Where
  /// fewer than wanted are taken four times as many are looked at, and so on up to 1024.
  void nearest(const Eigen::Vector2d& position_m, const Search& search, const std::function<bool(std::size_t)>& accept,
               std::vector<Neighbour>& found) const;

 private:
  class Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace visual_localization

#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// The nearest of a few thousand positions in constant time: a grid of cells, each with the positions that are the
/// nearest of some position in it. Exact; a position that has no cell, or a cell with too many candidates, has no
/// answer here.
class NearestGrid {
 public:
  /// All positions within `radius_m` of `centre_m`, in order of index; when those are too many for a cell, too many.
  using Within = std::function<std::vector<std::uint32_t>(const Eigen::Vector2d& centre_m, double radius_m)>;
  /// Distance to the nearest position, up to a billionth more.
  using Distance = std::function<double(const Eigen::Vector2d& position_m)>;

  /// `positions_m` must outlive the grid.
  NearestGrid(const std::vector<Eigen::Vector2d>& positions_m, const Distance& distance, const Within& within);

  /// The nearest position, the first of equals, with its squared distance.
  struct Found {
    std::uint32_t index = 0;
    double squared_m2 = 0.0;
  };
  std::optional<Found> nearest(const Eigen::Vector2d& position_m) const;

 private:
  const std::vector<Eigen::Vector2d>& positions_m_;
  Eigen::Vector2d min_m_ = Eigen::Vector2d::Zero();
  double cell_m_ = 1.0;
  std::size_t columns_ = 0;
  std::size_t rows_ = 0;
  std::vector<std::uint32_t> begins_;      ///< of each cell's candidates, and the end of the last
  std::vector<std::uint32_t> candidates_;  ///< cell by cell, in order of index
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
  std::unique_ptr<const NearestGrid> grid_;  ///< of small maps
};

}  // namespace visual_localization

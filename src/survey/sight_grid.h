#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>

#include <Eigen/Core>

namespace visual_localization {

constexpr int kOctants = 8;

/// Which eighth of the compass, counter-clockwise: 0 is centred on east, 2 on north.
int octantOf(double yaw_rad);

/// Which sessions have looked which way at which position: cells of a grid, eight directions in each. "Here" is a cell
/// and those around it, so within about 4 m. Takes time in proportion to the logarithm of the number of cells, wherever
/// they lie.
class SightGrid {
 public:
  static constexpr double kCell_m = 2.5;

  void add(const Eigen::Vector2d& position_m, double yaw_rad, int session);
  /// Another session looks about the same way here.
  bool otherSession(const Eigen::Vector2d& position_m, double yaw_rad, int session) const;
  /// A session before this one does.
  bool earlierSession(const Eigen::Vector2d& position_m, double yaw_rad, int session) const;
  /// Any session looks about the opposite way here.
  bool oppositeWay(const Eigen::Vector2d& position_m, double yaw_rad) const;
  /// Cells with an image.
  std::size_t cells() const { return cells_.size(); }

 private:
  struct TwoSessions {
    std::int32_t first = -1;   ///< the lowest; none is -1
    std::int32_t second = -1;  ///< any other
  };
  using Cell = std::array<TwoSessions, kOctants>;

  template <class Predicate>
  bool anyHere(const Eigen::Vector2d& position_m, int octant, Predicate holds) const;

  /// Sorted and not hashed: whoever makes a map chooses the keys, and could make all of them collide.
  std::map<std::uint64_t, Cell> cells_;
};

}  // namespace visual_localization

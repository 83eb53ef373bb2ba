#include "survey/sight_grid.h"

#include <algorithm>
#include <cmath>

#include "base/angles.h"

namespace visual_localization {
namespace {

/// Of the cell `dx`, `dy` beside the one at `position_m`. A map reaches 10^6 m, so each index fits into 32 bits. The
/// keys of a column follow each other.
std::uint64_t keyAt(const Eigen::Vector2d& position_m, int dx, int dy) {
  constexpr std::int64_t kZero = std::int64_t{1} << 31U;
  const auto column = static_cast<std::int64_t>(std::floor(position_m.x() / SightGrid::kCell_m)) + dx + kZero;
  const auto row = static_cast<std::int64_t>(std::floor(position_m.y() / SightGrid::kCell_m)) + dy + kZero;
  return static_cast<std::uint64_t>(column) << 32U | static_cast<std::uint64_t>(row);
}

}  // namespace

int octantOf(double yaw_rad) {
  const auto octant = static_cast<int>(std::lround(std::remainder(yaw_rad, 2.0 * kPi) / (kPi / 4.0)));
  return (octant + kOctants) % kOctants;
}

void SightGrid::add(const Eigen::Vector2d& position_m, double yaw_rad, int session) {
  TwoSessions& seen = cells_[keyAt(position_m, 0, 0)][static_cast<std::size_t>(octantOf(yaw_rad))];
  if (seen.first == -1 || session < seen.first) {
    if (seen.first != -1) seen.second = seen.first;
    seen.first = session;
  } else if (session != seen.first) {
    seen.second = session;
  }
}

template <class Predicate>
bool SightGrid::anyHere(const Eigen::Vector2d& position_m, int octant, Predicate holds) const {
  for (int dx = -1; dx <= 1; ++dx) {
    const std::uint64_t last = keyAt(position_m, dx, 1);
    auto cell = cells_.lower_bound(keyAt(position_m, dx, -1));
    for (; cell != cells_.end() && cell->first <= last; ++cell) {
      for (int turn = -1; turn <= 1; ++turn) {
        const TwoSessions& seen = cell->second[static_cast<std::size_t>((octant + turn + kOctants) % kOctants)];
        if (seen.first != -1 && holds(seen)) return true;
      }
    }
  }
  return false;
}

bool SightGrid::otherSession(const Eigen::Vector2d& position_m, double yaw_rad, int session) const {
  return anyHere(position_m, octantOf(yaw_rad),
                 [session](const TwoSessions& seen) { return seen.first != session || seen.second != -1; });
}

bool SightGrid::earlierSession(const Eigen::Vector2d& position_m, double yaw_rad, int session) const {
  return anyHere(position_m, octantOf(yaw_rad), [session](const TwoSessions& seen) { return seen.first < session; });
}

bool SightGrid::oppositeWay(const Eigen::Vector2d& position_m, double yaw_rad) const {
  return anyHere(position_m, (octantOf(yaw_rad) + kOctants / 2) % kOctants, [](const TwoSessions&) { return true; });
}

}  // namespace visual_localization

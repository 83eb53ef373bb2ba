#include "map/pruning_neighbours.h"

#include <algorithm>

#include "map/same_view.h"

namespace visual_localization {
namespace {

constexpr std::size_t kNeighbours = 2;       ///< Weiss et al., section III
constexpr std::size_t kMostLookedAt = 1024;  ///< where many images face another way

}  // namespace

PruningNeighbours::PruningNeighbours(const TrainingMap& map) : map_(map), sessions_(map.header().sessions.size()) {
  std::vector<std::vector<Eigen::Vector2d>> positions_m(sessions_.size());
  for (std::size_t i = 0; i < map.size(); ++i) {
    const auto session = static_cast<std::size_t>(map.place(i).session);
    sessions_[session].images.push_back(i);
    positions_m[session].push_back(map.position_m(i));
  }
  for (std::size_t s = 0; s < sessions_.size(); ++s) {
    if (!positions_m[s].empty()) sessions_[s].index = std::make_unique<PositionIndex>(std::move(positions_m[s]));
  }
}

std::vector<std::size_t> PruningNeighbours::of(std::size_t image) const {
  const Session& session = sessions_[static_cast<std::size_t>(map_.place(image).session)];
  std::vector<Neighbour> found;
  std::vector<std::size_t> neighbours;
  for (std::size_t count = kNeighbours + 1;; count = std::min(4 * count, kMostLookedAt)) {
    session.index->nearest(map_.position_m(image), count, found);
    neighbours.clear();
    for (const Neighbour& neighbour : found) {
      const std::size_t other = session.images[neighbour.image];
      if (other == image || !faceAlike(map_.yaw_rad(image), map_.yaw_rad(other))) continue;
      neighbours.push_back(other);
      if (neighbours.size() == kNeighbours) return neighbours;
    }
    if (found.size() < count || count == kMostLookedAt) return neighbours;
  }
}

}  // namespace visual_localization

#include "map/pruning_neighbours.h"

#include <utility>

#include "base/angles.h"

namespace visual_localization {
namespace {

constexpr std::size_t kNeighbours = 2;  ///< Weiss et al., section III

}  // namespace

PruningNeighbours::PruningNeighbours(const TrainingMap& map) : map_(map), sessions_(map.header().sessions.size()) {
  std::vector<std::vector<Eigen::Vector2d>> positions_m(sessions_.size());
  for (std::size_t i = 0; i < map.size(); ++i) {
    const auto session = static_cast<std::size_t>(map.pose(i).session);
    sessions_[session].images.push_back(i);
    positions_m[session].push_back(map.position_m(i));
  }
  for (std::size_t s = 0; s < sessions_.size(); ++s) {
    if (!positions_m[s].empty()) sessions_[s].index = std::make_unique<PositionIndex>(std::move(positions_m[s]));
  }
}

std::vector<std::size_t> PruningNeighbours::of(std::size_t image) const {
  const Session& session = sessions_[static_cast<std::size_t>(map_.pose(image).session)];
  const auto facesAlike = [&](std::size_t neighbour) {
    const std::size_t other = session.images[neighbour];
    return other != image && faceAlike(map_.yaw_rad(image), map_.yaw_rad(other));
  };
  std::vector<Neighbour> found;
  session.index->nearest(map_.position_m(image), {kNeighbours, kNeighbours + 1}, facesAlike, found);
  std::vector<std::size_t> neighbours;
  for (const Neighbour& neighbour : found) {
    if (neighbours.size() < kNeighbours) neighbours.push_back(session.images[neighbour.image]);
  }
  return neighbours;
}

}  // namespace visual_localization

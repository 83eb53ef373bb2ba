#include "map/pruning_neighbours.h"

#include "base/angles.h"

namespace visual_localization {
namespace {

constexpr std::size_t kNeighbours = 2;  ///< Weiss et al., section III

}  // namespace

PruningNeighbours::PruningNeighbours(const TrainingMap& map) : map_(map), sessions_(map) {}

std::vector<std::size_t> PruningNeighbours::of(std::size_t image) const {
  const auto facesAlike = [&](std::size_t other) {
    return other != image && faceAlike(map_.yaw_rad(image), map_.yaw_rad(other));
  };
  std::vector<Neighbour> found;
  sessions_.nearest(static_cast<std::size_t>(map_.pose(image).session), map_.position_m(image),
                    {kNeighbours, kNeighbours + 1}, facesAlike, found);
  std::vector<std::size_t> neighbours;
  for (const Neighbour& neighbour : found) {
    if (neighbours.size() < kNeighbours) neighbours.push_back(neighbour.image);
  }
  return neighbours;
}

}  // namespace visual_localization

#include "map/session_index.h"

#include <utility>

namespace visual_localization {

SessionIndex::SessionIndex(const TrainingMap& map) : sessions_(map.header().sessions.size()) {
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

Neighbour SessionIndex::nearest(std::size_t session, const Eigen::Vector2d& position_m) const {
  const Neighbour found = sessions_[session].index->nearest(position_m);
  return {sessions_[session].images[found.image], found.distance_m};
}

void SessionIndex::nearest(std::size_t session, const Eigen::Vector2d& position_m, const PositionIndex::Search& search,
                           const std::function<bool(std::size_t image)>& accept, std::vector<Neighbour>& found) const {
  found.clear();
  if (!has(session)) return;
  const std::vector<std::size_t>& images = sessions_[session].images;
  sessions_[session].index->nearest(
      position_m, search, [&](std::size_t i) { return accept(images[i]); }, found);
  for (Neighbour& neighbour : found) neighbour.image = images[neighbour.image];
}

}  // namespace visual_localization

#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "map/position_index.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// The training images of each session of a map by their positions.
class SessionIndex {
 public:
  explicit SessionIndex(const TrainingMap& map);

  /// False for a session of which the map has no image.
  bool has(std::size_t session) const { return sessions_[session].index != nullptr; }
  /// The image of a session that is nearest to `position_m`; the session has one.
  Neighbour nearest(std::size_t session, const Eigen::Vector2d& position_m) const;
  /// Into `found`: images of a session that `accept` takes, as PositionIndex::nearest finds them.
  void nearest(std::size_t session, const Eigen::Vector2d& position_m, const PositionIndex::Search& search,
               const std::function<bool(std::size_t image)>& accept, std::vector<Neighbour>& found) const;

 private:
  struct Session {
    std::vector<std::size_t> images;
    std::unique_ptr<const PositionIndex> index;  ///< of their positions
  };

  std::vector<Session> sessions_;
};

}  // namespace visual_localization

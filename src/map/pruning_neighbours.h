#pragma once

#include <cstddef>
#include <vector>

#include "map/session_index.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// Which images of an unpruned map decide what is noise in an image: the nearest ones (Weiss et al., section III) of
/// those that should show the same. That leaves out other sessions, whose light, and images that face another way,
/// whose view is another one: they would drop nearly all features. So a session is pruned as if it were alone.
class PruningNeighbours {
 public:
  /// `map` must outlive it.
  explicit PruningNeighbours(const TrainingMap& map);

  /// At most two, closest first; none when no other image shows the same.
  std::vector<std::size_t> of(std::size_t image) const;

 private:
  const TrainingMap& map_;
  SessionIndex sessions_;
};

}  // namespace visual_localization

#include "visual_localization/evaluation/partial_map.h"

#include <cmath>
#include <utility>

namespace visual_localization {

PartialMap withGap(std::shared_ptr<const TrainingMap> map, double share) {
  constexpr double kBegin = 0.35;
  if (share <= 0.0) return {std::move(map), {}};
  const auto shareOfMap = [&map](double part) {
    return static_cast<std::size_t>(std::lround(part * static_cast<double>(map->size())));
  };
  const std::size_t begin = shareOfMap(kBegin);
  const std::size_t end = begin + shareOfMap(share);
  PartialMap partial;
  std::vector<TrainingImage> kept;
  for (std::size_t i = 0; i < map->size(); ++i) {
    if (i >= begin && i < end) continue;
    kept.push_back(map->image(i));
    partial.images.push_back(i);
  }
  partial.map = std::make_shared<TrainingMap>(map->header(), std::move(kept));
  return partial;
}

}  // namespace visual_localization

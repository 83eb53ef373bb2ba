#include "localization/heading.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "base/angles.h"

namespace visual_localization {

Heading headingOf(const TrainingMap& map, const TrackerEstimate& tracked, bool recognised,
                  std::vector<Neighbour>& neighbours) {
  constexpr std::size_t kNeighbours = 5;
  // A robot that comes round a corner has images of both its sides; one that comes back is turned by about pi.
  constexpr double kFacesAway_rad = 2.0 / 3.0 * kPi;
  const auto faces_away = [&](std::size_t image) {
    return recognised &&
           std::abs(angleDifference(map.yaw_rad(tracked.best_image), map.yaw_rad(image))) > kFacesAway_rad;
  };
  Heading heading;
  heading.yaw_rad = map.yaw_rad(faces_away(tracked.training_image) ? tracked.best_image : tracked.training_image);
  map.nearest(tracked.position_m, kNeighbours, neighbours);
  const auto sameWay = [&](const Neighbour& neighbour) { return !faces_away(neighbour.image); };
  const bool any_same_way = std::any_of(neighbours.begin(), neighbours.end(), sameWay);
  std::size_t counted = 0;
  for (const Neighbour& neighbour : neighbours) {
    if (any_same_way && !sameWay(neighbour)) continue;
    const double difference = angleDifference(heading.yaw_rad, map.yaw_rad(neighbour.image));
    heading.variance_rad2 += difference * difference;
    ++counted;
  }
  if (counted > 0) heading.variance_rad2 /= static_cast<double>(counted);
  return heading;
}

}  // namespace visual_localization

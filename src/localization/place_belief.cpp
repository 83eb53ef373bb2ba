// What the filter over places says of itself, for people.

#include <algorithm>

#include "localization/place_filter.h"

namespace visual_localization {

PlaceBelief PlaceFilter::beliefAround(const Eigen::Vector2d& position_m, double radius_m) const {
  PlaceBelief belief;
  belief.off_map = offMap();
  belief.followed = within(position_m, radius_m);
  belief.rival = rivalOf(position_m, radius_m);
  belief.end = likelyEnd();
  return belief;
}

/// The most probable of the training images whose surroundings do not reach into those of the position, with these.
std::optional<PlaceBelief::Place> PlaceFilter::rivalOf(const Eigen::Vector2d& position_m, double radius_m) const {
  const double nearest_m = radius_m + around_m();
  std::optional<PlaceBelief::Place> rival;
  for (const PlaceProbabilities::Own& one : places_.allOwn()) {
    if (!where_.hasImage(one.training_image) || (rival && one.probability <= rival->probability)) continue;
    const Eigen::Vector2d& place_m = where_.position_m(one.training_image);
    if ((place_m - position_m).norm() > nearest_m) rival = {one.training_image, place_m, one.probability};
  }
  if (rival) rival->probability = probabilityWithin(rival->position_m, around_m());
  return rival;
}

/// The end of a path with most probability beyond it, when that is more than all of the map has.
std::optional<PlaceBelief::Place> PlaceFilter::likelyEnd() const {
  constexpr double kLikely = 0.5;
  if (beyond() < kLikely) return std::nullopt;
  PlaceBelief::Place end;
  for (std::size_t place = map_.size(); place < where_.size();) {
    const std::size_t image = where_.image(place);
    const double probability = beyond(image);
    if (probability > end.probability) end = {image, map_.position_m(image), probability};
    place = where_.beyond(image).second;
  }
  end.probability *= 1.0 - off_map_.probability();
  return end;
}

}  // namespace visual_localization

#include "visual_localization/map/training_places.h"

namespace visual_localization {

void TrainingPlaces::reserve(std::size_t count) {
  positions_m.reserve(count);
  yaws_rad.reserve(count);
  stamps_ns.reserve(count);
  sessions.reserve(count);
  feature_counts.reserve(count);
}

void TrainingPlaces::add(const TrainingPlace& place, std::size_t feature_count) {
  positions_m.push_back(place.position_m);
  yaws_rad.push_back(place.yaw_rad);
  stamps_ns.push_back(place.stamp_ns);
  sessions.push_back(place.session);
  feature_counts.push_back(static_cast<std::uint32_t>(feature_count));
}

TrainingPlaces placesOf(const std::vector<TrainingImage>& images) {
  TrainingPlaces places;
  places.reserve(images.size());
  for (const TrainingImage& image : images) places.add(image, image.sift.size());
  return places;
}

}  // namespace visual_localization

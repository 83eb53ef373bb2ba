#include "visual_localization/map/training_map.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "base/angles.h"
#include "map/feature_store.h"
#include "map/position_index.h"

namespace visual_localization {
namespace {

/// A pointer that owns nothing, for what lives as long as the store: no count that threads would contend for.
template <class T>
std::shared_ptr<const T> unowned(const T& value) {
  return {std::shared_ptr<const T>(), &value};
}

[[noreturn]] void refuse(std::size_t image, const std::string& reason) {
  throw std::invalid_argument("training map: image " + std::to_string(image) + ": " + reason);
}

/// The places, if a map can be made of them.
TrainingPlaces checked(const MapHeader& header, TrainingPlaces places) {
  if (places.size() == 0) throw std::invalid_argument("training map: there is no image");
  if (header.image_size.width <= 0 || header.image_size.height <= 0) {
    throw std::invalid_argument("training map: image size " + std::to_string(header.image_size.width) + "x" +
                                std::to_string(header.image_size.height) + " is not positive");
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Eigen::Vector2d& position_m = places.positions_m[i];
    const int session = places.sessions[i];
    if (!position_m.allFinite()) refuse(i, "position is not finite");
    if (position_m.cwiseAbs().maxCoeff() > kLargestCoordinate_m) {
      refuse(i, "position is farther than " + std::to_string(static_cast<int>(kLargestCoordinate_m)) +
                    " m from the datum");
    }
    if (!std::isfinite(places.yaws_rad[i])) refuse(i, "heading is not finite");
    if (session < 0 || static_cast<std::size_t>(session) >= header.sessions.size()) {
      refuse(i, "session " + std::to_string(session) + " is not one of " + std::to_string(header.sessions.size()));
    }
  }
  return places;
}

Area boundingBox(const std::vector<Eigen::Vector2d>& positions_m) {
  Area area{positions_m.front(), positions_m.front()};
  for (const Eigen::Vector2d& position : positions_m) {
    area.min_m = area.min_m.cwiseMin(position);
    area.max_m = area.max_m.cwiseMax(position);
  }
  return area;
}

}  // namespace

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

MemoryFeatureStore::MemoryFeatureStore(std::vector<TrainingImage>&& images) {
  sift_.reserve(images.size());
  global_.reserve(images.size());
  previews_.reserve(images.size());
  for (TrainingImage& image : images) {
    sift_.push_back(std::move(image.sift));
    global_.push_back(image.global);
    previews_.push_back(std::move(image.preview_jpeg));
  }
}

std::shared_ptr<const SiftFeatures> MemoryFeatureStore::sift(std::size_t image) const { return unowned(sift_[image]); }

std::shared_ptr<const GlobalFeatures> MemoryFeatureStore::global(std::size_t image) const {
  return unowned(global_[image]);
}

TrainingMap::TrainingMap(MapHeader header, std::vector<TrainingImage> images)
    : header_(std::move(header)),
      frame_(header_.datum),
      places_(checked(header_, placesOf(images))),
      store_(std::make_unique<MemoryFeatureStore>(std::move(images))),
      area_(boundingBox(places_.positions_m)),
      index_(std::make_unique<const PositionIndex>(places_.positions_m)) {}

TrainingMap::TrainingMap(MapHeader header, TrainingPlaces places, std::unique_ptr<const FeatureStore> store)
    : header_(std::move(header)),
      frame_(header_.datum),
      places_(checked(header_, std::move(places))),
      store_(std::move(store)),
      area_(boundingBox(places_.positions_m)),
      index_(std::make_unique<const PositionIndex>(places_.positions_m)) {}

TrainingMap::~TrainingMap() = default;

std::shared_ptr<const SiftFeatures> TrainingMap::sift(std::size_t i) const { return store_->sift(i); }

std::shared_ptr<const GlobalFeatures> TrainingMap::global(std::size_t i) const { return store_->global(i); }

std::vector<std::uint8_t> TrainingMap::preview(std::size_t i) const { return store_->preview(i); }

std::size_t TrainingMap::globalsKept() const { return store_->globalsKept(); }

TrainingPlace TrainingMap::place(std::size_t i) const {
  return {places_.stamps_ns[i], places_.sessions[i], places_.positions_m[i], places_.yaws_rad[i]};
}

TrainingImage TrainingMap::image(std::size_t i) const {
  const TrainingPlace taken_at = place(i);  // GCC 9 and 10 crash at an unnamed one
  return {taken_at, *store_->sift(i), *store_->global(i), store_->preview(i)};
}

Neighbour TrainingMap::nearest(const Eigen::Vector2d& position_m) const { return index_->nearest(position_m); }

std::vector<Neighbour> TrainingMap::nearest(const Eigen::Vector2d& position_m, std::size_t count) const {
  std::vector<Neighbour> found;
  nearest(position_m, count, found);
  return found;
}

void TrainingMap::nearest(const Eigen::Vector2d& position_m, std::size_t count, std::vector<Neighbour>& found) const {
  index_->nearest(position_m, count, found);
}

Heading headingAt(const TrainingMap& map, const Eigen::Vector2d& position_m, std::optional<std::size_t> recognised,
                  std::vector<Neighbour>& neighbours) {
  constexpr std::size_t kNeighbours = 5;
  // A robot that comes round a corner has images of both its sides; one that comes back is turned by about pi.
  constexpr double kFacesAway_rad = 2.0 / 3.0 * kPi;
  const auto sameWay = [&](const Neighbour& neighbour) {
    return !recognised ||
           std::abs(angleDifference(map.yaw_rad(*recognised), map.yaw_rad(neighbour.image))) <= kFacesAway_rad;
  };
  map.nearest(position_m, kNeighbours, neighbours);
  Heading heading;
  heading.yaw_rad = map.yaw_rad(sameWay(neighbours.front()) ? neighbours.front().image : *recognised);
  const bool any_same_way = std::any_of(neighbours.begin(), neighbours.end(), sameWay);
  std::size_t counted = 0;
  for (const Neighbour& neighbour : neighbours) {
    if (any_same_way && !sameWay(neighbour)) continue;
    const double difference = angleDifference(heading.yaw_rad, map.yaw_rad(neighbour.image));
    heading.variance_rad2 += difference * difference;
    ++counted;
  }
  heading.variance_rad2 /= static_cast<double>(counted);
  return heading;
}

}  // namespace visual_localization

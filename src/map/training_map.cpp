#include "visual_localization/map/training_map.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>

#include "base/numbers.h"
#include "base/time.h"
#include "map/feature_store.h"
#include "map/map_geometry.h"
#include "map/position_index.h"

namespace visual_localization {
namespace {

/// 2^32 s, as far as a stamp of ROS reaches; so the difference of two fits into 64 bits.
constexpr std::int64_t kFarthestStamp_ns = 4'294'967'296'000'000'000;

[[noreturn]] void refuse(std::size_t image, const std::string& reason) {
  throw std::invalid_argument("training map: image " + std::to_string(image) + ": " + reason);
}

void requireOfSize(const cv::Size& size, const cv::Size& image_size, const std::string& what) {
  if (size == image_size) return;
  throw std::invalid_argument("training map: " + what + " is for images of " + std::to_string(size.width) + "x" +
                              std::to_string(size.height) + ", not for the map's");
}

void requireCamerasOfSize(const MapHeader& header) {
  for (std::size_t i = 0; i < header.sessions.size(); ++i) {
    const Session& session = header.sessions[i];
    const std::string of_session = " of session " + std::to_string(i);
    if (session.camera) requireOfSize(session.camera->size(), header.image_size, "the camera" + of_session);
    if (session.published) {
      requireOfSize(session.published->size(), header.image_size, "the published camera" + of_session);
    }
    if (!session.mask.empty()) requireOfSize(session.mask.size(), header.image_size, "the mask" + of_session);
  }
}

/// The poses, if a map can be made of them.
TrainingPoses checked(const MapHeader& header, TrainingPoses poses) {
  if (poses.size() == 0) throw std::invalid_argument("training map: there is no image");
  if (header.image_size.width <= 0 || header.image_size.height <= 0) {
    throw std::invalid_argument("training map: image size " + std::to_string(header.image_size.width) + "x" +
                                std::to_string(header.image_size.height) + " is not positive");
  }
  requireCamerasOfSize(header);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Vector2d& position_m = poses.positions_m[i];
    const int session = poses.sessions[i];
    if (!position_m.allFinite()) refuse(i, "position is not finite");
    if (position_m.cwiseAbs().maxCoeff() > kLargestCoordinate_m) {
      refuse(i, "position is farther than " + std::to_string(static_cast<int>(kLargestCoordinate_m)) +
                    " m from the datum");
    }
    if (!std::isfinite(poses.yaws_rad[i])) refuse(i, "heading is not finite");
    if (poses.stamps_ns[i] < -kFarthestStamp_ns || poses.stamps_ns[i] > kFarthestStamp_ns) {
      refuse(i, "stamp " + secondsText(poses.stamps_ns[i]) + " s is more than 4294967296 s from zero");
    }
    if (session < 0 || static_cast<std::size_t>(session) >= header.sessions.size()) {
      refuse(i, "session " + std::to_string(session) + " is not one of " + std::to_string(header.sessions.size()));
    }
  }
  return poses;
}

const std::vector<TrainingImage>& checked(const MapHeader& header, const std::vector<TrainingImage>& images) {
  const std::size_t vlad_bytes = header.vocabulary ? header.vocabulary->bytes() : 0;
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (images[i].vlad.size() != vlad_bytes) {
      refuse(i, "its VLAD has " + std::to_string(images[i].vlad.size()) + " bytes instead of " +
                    std::to_string(vlad_bytes));
    }
    if (!images[i].geometry) continue;
    try {
      requireUsable(*images[i].geometry, images[i].local.size());
    } catch (const std::runtime_error& error) {
      refuse(i, error.what());
    }
  }
  return images;
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

void TrainingPoses::reserve(std::size_t count) {
  positions_m.reserve(count);
  yaws_rad.reserve(count);
  stamps_ns.reserve(count);
  sessions.reserve(count);
  feature_counts.reserve(count);
}

void TrainingPoses::add(const TrainingPose& pose, std::size_t feature_count) {
  positions_m.push_back(pose.position_m);
  yaws_rad.push_back(pose.yaw_rad);
  stamps_ns.push_back(pose.stamp_ns);
  sessions.push_back(pose.session);
  feature_counts.push_back(static_cast<std::uint32_t>(feature_count));
}

TrainingPoses posesOf(const std::vector<TrainingImage>& images) {
  TrainingPoses poses;
  poses.reserve(images.size());
  for (const TrainingImage& image : images) poses.add(image, image.local.size());
  return poses;
}

TrainingMap::TrainingMap(MapHeader header, std::vector<TrainingImage> images)
    : header_(std::move(header)),
      frame_(header_.datum),
      poses_(checked(header_, posesOf(checked(header_, images)))),
      store_(std::make_unique<MemoryFeatureStore>(std::move(images))),
      area_(boundingBox(poses_.positions_m)),
      index_(std::make_unique<const PositionIndex>(poses_.positions_m)) {}

TrainingMap::TrainingMap(MapHeader header, TrainingPoses poses, std::unique_ptr<const FeatureStore> store)
    : header_(std::move(header)),
      frame_(header_.datum),
      poses_(checked(header_, std::move(poses))),
      store_(std::move(store)),
      area_(boundingBox(poses_.positions_m)),
      index_(std::make_unique<const PositionIndex>(poses_.positions_m)) {}

TrainingMap::~TrainingMap() = default;

std::shared_ptr<const LocalFeatures> TrainingMap::local(std::size_t i) const { return store_->local(i); }

std::shared_ptr<const GlobalFeatures> TrainingMap::global(std::size_t i) const { return store_->global(i); }

std::shared_ptr<const VladDescriptor> TrainingMap::vlad(std::size_t i) const { return store_->vlad(i); }

std::vector<std::uint8_t> TrainingMap::preview(std::size_t i) const { return store_->preview(i); }

std::shared_ptr<const ImageGeometry> TrainingMap::geometry(std::size_t i) const { return store_->geometry(i); }

std::size_t TrainingMap::geometryCount() const { return store_->geometryCount(); }

std::size_t TrainingMap::globalsKept() const { return store_->globalsKept(); }

TrainingPose TrainingMap::pose(std::size_t i) const {
  return {poses_.stamps_ns[i], poses_.sessions[i], poses_.positions_m[i], poses_.yaws_rad[i]};
}

TrainingImage TrainingMap::image(std::size_t i) const {
  const TrainingPose taken_at = pose(i);  // GCC 9 and 10 crash at an unnamed one
  TrainingImage image{taken_at, *store_->local(i), *store_->global(i), store_->preview(i)};
  const std::shared_ptr<const ImageGeometry> geometry = store_->geometry(i);
  image.vlad = *store_->vlad(i);
  // Features that cannot be read count as none, and landmarks belong to features.
  if (geometry && image.local.size() == featureCount(i)) image.geometry = *geometry;
  return image;
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

void TrainingMap::within(const Eigen::Vector2d& position_m, double radius_m, std::vector<std::uint32_t>& found) const {
  index_->within(position_m, radius_m, found);
}

void TrainingMap::nearestFacing(std::size_t i, std::size_t count, double radius_m,
                                std::vector<Neighbour>& found) const {
  const auto facesAlike = [&](std::size_t other) { return other != i && faceAlike(yaw_rad(i), yaw_rad(other)); };
  index_->nearest(position_m(i), {1, count, radius_m}, facesAlike, found);
}

Heading headingAt(const TrainingMap& map, const Eigen::Vector2d& position_m, std::optional<std::size_t> recognised,
                  std::vector<Neighbour>& neighbours) {
  constexpr std::size_t kNeighbours = 5;
  // A robot that comes around a corner has images of both its sides; one that comes back is turned by about pi.
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

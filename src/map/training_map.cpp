#include "visual_localization/map/training_map.h"

#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace visual_localization {
namespace {

[[noreturn]] void refuse(std::size_t image, const std::string& reason) {
  throw std::invalid_argument("training map: image " + std::to_string(image) + ": " + reason);
}

/// The images, if a map can be made of them.
std::vector<TrainingImage> checked(const MapHeader& header, std::vector<TrainingImage> images) {
  if (images.empty()) throw std::invalid_argument("training map: there is no image");
  if (header.image_size.width <= 0 || header.image_size.height <= 0) {
    throw std::invalid_argument("training map: image size " + std::to_string(header.image_size.width) + "x" +
                                std::to_string(header.image_size.height) + " is not positive");
  }
  for (std::size_t i = 0; i < images.size(); ++i) {
    const TrainingImage& image = images[i];
    if (!image.position_m.allFinite()) refuse(i, "position is not finite");
    if (image.position_m.cwiseAbs().maxCoeff() > kLargestCoordinate_m) {
      refuse(i, "position is farther than " + std::to_string(static_cast<int>(kLargestCoordinate_m)) +
                    " m from the datum");
    }
    if (!std::isfinite(image.yaw_rad)) refuse(i, "heading is not finite");
    if (image.session < 0 || static_cast<std::size_t>(image.session) >= header.sessions.size()) {
      refuse(i,
             "session " + std::to_string(image.session) + " is not one of " + std::to_string(header.sessions.size()));
    }
  }
  return images;
}

Area boundingBox(const std::vector<TrainingImage>& images) {
  Area area{images.front().position_m, images.front().position_m};
  for (const TrainingImage& image : images) {
    area.min_m = area.min_m.cwiseMin(image.position_m);
    area.max_m = area.max_m.cwiseMax(image.position_m);
  }
  return area;
}

std::vector<Eigen::Vector2d> positionsOf(const std::vector<TrainingImage>& images) {
  std::vector<Eigen::Vector2d> positions;
  positions.reserve(images.size());
  for (const TrainingImage& image : images) positions.push_back(image.position_m);
  return positions;
}

}  // namespace

TrainingMap::TrainingMap(MapHeader header, std::vector<TrainingImage> images)
    : header_(std::move(header)),
      frame_(header_.datum),
      images_(checked(header_, std::move(images))),
      area_(boundingBox(images_)),
      index_(positionsOf(images_)) {}

Neighbour TrainingMap::nearest(const Eigen::Vector2d& position_m) const { return index_.nearest(position_m); }

std::vector<Neighbour> TrainingMap::nearest(const Eigen::Vector2d& position_m, std::size_t count) const {
  return index_.nearest(position_m, count);
}

}  // namespace visual_localization

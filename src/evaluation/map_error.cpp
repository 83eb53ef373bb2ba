#include "evaluation/map_error.h"

#include <cstddef>
#include <limits>

#include "base/angles.h"

namespace visual_localization {
namespace {

/// A training image whose true pose is known, in the map frame.
struct KnownImage {
  Eigen::Vector2d true_position_m = Eigen::Vector2d::Zero();
  std::optional<double> true_yaw_rad;
  MapError error;
};

std::vector<KnownImage> knownImages(const PartialMap& part, const std::vector<std::optional<TruePose>>& truth) {
  std::vector<KnownImage> known;
  const TrainingMap& map = *part.map;
  for (std::size_t i = 0; i < map.size() && !truth.empty(); ++i) {
    const std::optional<TruePose>& pose = truth[part.images.empty() ? i : part.images[i]];
    if (!pose) continue;
    KnownImage image{map.frame().toEastNorth(pose->position), pose->yaw_rad, {}};
    image.error.position_m = map.position_m(i) - image.true_position_m;
    if (pose->yaw_rad) image.error.yaw_rad = angleDifference(*pose->yaw_rad, map.yaw_rad(i));
    known.push_back(image);
  }
  return known;
}

bool mayFaceAlike(const std::optional<double>& yaw_rad, const std::optional<double>& other_rad) {
  return !yaw_rad || !other_rad || faceAlike(*yaw_rad, *other_rad);
}

std::optional<MapError> errorAt(const std::vector<KnownImage>& images, const Eigen::Vector2d& position_m,
                                const std::optional<double>& yaw_rad) {
  std::optional<MapError> error;
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const KnownImage& image : images) {
    const double distance_m = (image.true_position_m - position_m).norm();
    if (distance_m >= nearest_m || !mayFaceAlike(yaw_rad, image.true_yaw_rad)) continue;
    nearest_m = distance_m;
    error = image.error;
  }
  return error;
}

}  // namespace

std::vector<std::optional<MapError>> mapErrors(const PartialMap& part,
                                               const std::vector<std::optional<TruePose>>& truth, const Drive& drive) {
  const std::vector<KnownImage> images = knownImages(part, truth);
  std::vector<std::optional<MapError>> errors;
  for (const DriveImage& image : drive.images) {
    errors.push_back(image.truth
                         ? errorAt(images, part.map->frame().toEastNorth(image.truth->position), image.truth->yaw_rad)
                         : std::nullopt);
  }
  return errors;
}

}  // namespace visual_localization

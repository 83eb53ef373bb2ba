#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "base/numbers.h"
#include "evaluation/run.h"

namespace visual_localization {
namespace {

std::vector<std::size_t> outsideGap(std::size_t images, double gap) {
  constexpr double kBegin = 0.35;
  const auto shareOfMap = [images](double part) {
    return static_cast<std::size_t>(std::lround(part * static_cast<double>(images)));
  };
  const std::size_t begin = shareOfMap(kBegin);
  const std::size_t end = begin + (gap > 0.0 ? shareOfMap(gap) : 0);
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < images; ++i) {
    if (i < begin || i >= end) kept.push_back(i);
  }
  return kept;
}

std::vector<std::size_t> spaced(const TrainingMap& map, const std::vector<std::size_t>& images, double spacing_m) {
  std::vector<std::size_t> kept;
  for (const std::size_t i : images) {
    const bool follows = !kept.empty() && map.pose(kept.back()).session == map.pose(i).session;
    if (follows && (map.position_m(i) - map.position_m(kept.back())).norm() < spacing_m) continue;
    kept.push_back(i);
  }
  return kept;
}

}  // namespace

PartialMap partOf(std::shared_ptr<const TrainingMap> map, double gap, double spacing_m) {
  if (gap <= 0.0 && spacing_m <= 0.0) return {std::move(map), {}};
  PartialMap partial;
  std::vector<TrainingImage> kept;
  for (const std::size_t i : spaced(*map, outsideGap(map->size(), gap), spacing_m)) {
    kept.push_back(map->image(i));
    partial.images.push_back(i);
  }
  partial.map = std::make_shared<TrainingMap>(map->header(), std::move(kept));
  return partial;
}

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
    if (!pose || (map.hasGeometry() && !map.geometry(i))) continue;
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

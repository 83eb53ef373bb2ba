#include "localization/places.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/numbers.h"

namespace visual_localization {
namespace {

// Places beyond an end: as far as a robot drives on before nothing of the end's image is left to match.
constexpr double kBeyond_m = 40.0;
constexpr std::size_t kLeast = 20;
constexpr std::size_t kMost = 100;
constexpr std::size_t kFarInOrder = 20;  ///< training images from one on, of which a round that closes comes back

Eigen::Vector2d directionOf(double yaw_rad) { return {std::cos(yaw_rad), std::sin(yaw_rad)}; }

/// Whether training images lead on from one, in a direction.
class PathEnds {
 public:
  PathEnds(const TrainingMap& map, double gap_m) : map_(map), gap_m_(gap_m) {}

  /// How far the path has no image there; 0 where it goes on. `step`: 1 ahead, -1 behind.
  double room_m(std::size_t image, int step) {
    const bool is_last = step > 0 ? image + 1 == map_.size() : image == 0;
    const std::size_t next = is_last ? image : image + static_cast<std::size_t>(step);
    const bool is_of_session = !is_last && map_.pose(next).session == map_.pose(image).session;
    const double next_m = (map_.position_m(next) - map_.position_m(image)).norm();
    if ((is_of_session && next_m <= gap_m_) || otherLeadsOn(image, step)) return 0.0;
    return is_of_session ? next_m : std::numeric_limits<double>::infinity();
  }

 private:
  bool otherLeadsOn(std::size_t image, int step) {
    constexpr double kAhead = 0.5;  // cosine
    const Eigen::Vector2d ahead = step * directionOf(map_.yaw_rad(image));
    map_.within(map_.position_m(image), gap_m_, around_);
    return std::any_of(around_.begin(), around_.end(), [&](std::uint32_t other) {
      const Eigen::Vector2d offset_m = map_.position_m(other) - map_.position_m(image);
      // One of another session; of the same one a round that closes.
      const bool is_far_in_order =
          map_.pose(other).session != map_.pose(image).session ||
          std::max<std::size_t>(other, image) - std::min<std::size_t>(other, image) > kFarInOrder;
      return is_far_in_order && ahead.dot(offset_m) > kAhead * offset_m.norm() &&
             faceAlike(map_.yaw_rad(image), map_.yaw_rad(other));
    });
  }

  const TrainingMap& map_;
  double gap_m_;
  std::vector<std::uint32_t> around_;
};

}  // namespace

Places::Places(const TrainingMap& map, double spacing_m, double gap_m) : map_(map) {
  findEnds(spacing_m, gap_m);
  if (!positions_m_.empty()) index_ = std::make_unique<const PositionIndex>(positions_m_);
}

void Places::findEnds(double spacing_m, double gap_m) {
  PathEnds ends(map_, gap_m);
  const double wanted = std::ceil(kBeyond_m / spacing_m);
  const auto chain = static_cast<std::size_t>(std::clamp(wanted, 1.0 * kLeast, 1.0 * kMost));
  for (std::size_t i = 0; i < map_.size(); ++i) {
    for (const int step : {-1, 1}) {
      const double room_m = ends.room_m(i, step);
      const Eigen::Vector2d step_m = step * spacing_m * directionOf(map_.yaw_rad(i));
      for (std::size_t k = 1; k <= chain && static_cast<double>(k) * spacing_m < room_m; ++k) {
        positions_m_.emplace_back(map_.position_m(i) + static_cast<double>(k) * step_m);
        ends_.push_back(i);
      }
    }
  }
}

std::pair<std::size_t, std::size_t> Places::beyond(std::size_t training_image) const {
  const auto range = std::equal_range(ends_.begin(), ends_.end(), training_image);
  const auto placeOf = [this](auto at) { return map_.size() + static_cast<std::size_t>(at - ends_.begin()); };
  return {placeOf(range.first), placeOf(range.second)};
}

Neighbour Places::nearest(const Eigen::Vector2d& position_m) const {
  const Neighbour image = map_.nearest(position_m);
  if (!index_) return image;
  const Neighbour beyond = index_->nearest(position_m);
  return beyond.distance_m < image.distance_m ? Neighbour{map_.size() + beyond.image, beyond.distance_m} : image;
}

void Places::nearest(const Eigen::Vector2d& position_m, std::size_t count, std::vector<Neighbour>& found) const {
  map_.nearest(position_m, count, found);
  if (!index_) return;
  index_->nearest(position_m, count, nearest_);
  const auto images = static_cast<std::ptrdiff_t>(found.size());
  for (const Neighbour& one : nearest_) found.push_back({map_.size() + one.image, one.distance_m});
  const auto isNearer = [](const Neighbour& a, const Neighbour& b) { return a.distance_m < b.distance_m; };
  std::inplace_merge(found.begin(), found.begin() + images, found.end(), isNearer);
  found.resize(std::min(count, found.size()));
}

void Places::within(const Eigen::Vector2d& position_m, double radius_m, std::vector<std::uint32_t>& found) const {
  map_.within(position_m, radius_m, found);
  if (!index_) return;
  index_->within(position_m, radius_m, within_);
  for (const std::uint32_t one : within_) found.push_back(static_cast<std::uint32_t>(map_.size()) + one);
}

}  // namespace visual_localization

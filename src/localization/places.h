#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "map/position_index.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// Where the robot may be: at the training images, and at places of its path that have none, a chain of them beyond
/// each end of a session and of each gap in it. There it sees the image at that end, from farther away. Training images
/// come first.
class Places {
 public:
  /// `map` must outlive it. `spacing_m`: of successive training images; `gap_m`: where the next one is farther, the
  /// path ends.
  Places(const TrainingMap& map, double spacing_m, double gap_m);

  std::size_t size() const { return map_.size() + ends_.size(); }
  bool hasImage(std::size_t place) const { return place < map_.size(); }
  /// That of the place, or at the end that it lies beyond.
  std::size_t image(std::size_t place) const { return hasImage(place) ? place : ends_[place - map_.size()]; }
  /// The places beyond a training image: [first, last).
  std::pair<std::size_t, std::size_t> beyond(std::size_t training_image) const;

  const Eigen::Vector2d& position_m(std::size_t place) const {
    return hasImage(place) ? map_.position_m(place) : positions_m_[place - map_.size()];
  }
  double yaw_rad(std::size_t place) const { return map_.yaw_rad(image(place)); }

  // As those of TrainingMap.
  Neighbour nearest(const Eigen::Vector2d& position_m) const;
  void nearest(const Eigen::Vector2d& position_m, std::size_t count, std::vector<Neighbour>& found) const;
  void within(const Eigen::Vector2d& position_m, double radius_m, std::vector<std::uint32_t>& found) const;

 private:
  void findEnds(double spacing_m, double gap_m);

  const TrainingMap& map_;
  // Of the places without an image.
  std::vector<std::size_t> ends_;  ///< the training image of each, in order
  std::vector<Eigen::Vector2d> positions_m_;
  std::unique_ptr<const PositionIndex> index_;  ///< null: there are none
  mutable std::vector<Neighbour> nearest_;
  mutable std::vector<std::uint32_t> within_;
};

}  // namespace visual_localization

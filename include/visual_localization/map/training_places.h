#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/map/training_image.h"

namespace visual_localization {

/// Where the images of a map were taken, image by image: 40 bytes each, all that is always in memory of a large map.
struct TrainingPlaces {
  std::vector<Eigen::Vector2d> positions_m;  ///< east, north in the map frame
  std::vector<double> yaws_rad;              ///< direction of travel, 0 = east, counter-clockwise
  std::vector<std::int64_t> stamps_ns;
  std::vector<std::int32_t> sessions;         ///< which of MapHeader::sessions
  std::vector<std::uint32_t> feature_counts;  ///< SIFT features after pruning

  std::size_t size() const { return stamps_ns.size(); }
  void reserve(std::size_t count);
  void add(const TrainingPlace& place, std::size_t feature_count);
};

/// The places of these images, in their order.
TrainingPlaces placesOf(const std::vector<TrainingImage>& images);

}  // namespace visual_localization

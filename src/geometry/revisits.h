#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "visual_localization/geo/trajectory.h"

namespace visual_localization {

/// An image on the cleaned path of its session.
struct PathImage {
  std::uint32_t session = 0;
  TrajectoryPoint at;
};

/// Pairs of images, the smaller index first, that may show the same from about the same position, though they were not
/// recorded one after the other: of different sessions, or of one that comes back after a while. Each image is paired
/// with the nearest one that faces alike of each such visit, with three of them at most. Images of a session follow
/// each other.
std::vector<std::pair<std::uint32_t, std::uint32_t>> revisits(const std::vector<PathImage>& images);

}  // namespace visual_localization

#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// A jump of the robot that nobody tells it about.
struct Kidnapping {
  std::size_t at = 0;  ///< number of images before it
  std::size_t to = 0;  ///< index of the first image after it
};

/// The order in which a run sees the images of a closed drive: every step one image, starting at `start`, wrapping
/// at the end, with an optional jump (protocol of Kronfeld et al. (journal), section 6). As many steps as the
/// drive has images. Throws std::invalid_argument, naming the allowed range, for an index beyond the drive.
std::vector<std::size_t> imageOrder(std::size_t images, std::size_t start, const std::optional<Kidnapping>& kidnapping);

/// How the runs of an experiment go through a drive.
struct RunShape {
  bool closed = true;      ///< indices wrap; an open drive is followed to its end
  double speed = 1.0;      ///< images of the drive per step: at 2 every other one, at 1/2 each one twice
  bool kidnapped = false;  ///< after half of the run carried by half of the drive; an open one back
};

/// The images that the run beginning at `start` sees: once around a closed drive, to the end of an open one.
std::vector<std::size_t> imageOrder(std::size_t images, std::size_t start, const RunShape& shape);

/// Where the runs begin: every image of a closed drive, or of the first half of an open one; `count` of them, evenly
/// spread, unless that is 0 or more than there are.
std::vector<std::size_t> startImages(std::size_t images, bool closed, std::size_t count);

/// A map with some of its images left out, as when the robot leaves the recorded way.
struct PartialMap {
  std::shared_ptr<const TrainingMap> map;
  std::vector<std::size_t> images;  ///< index in the whole map of each image that is left; empty when all are
};

/// Leaves out the share `gap` of the images, beginning with image 0.35 * size, and then those nearer than `spacing_m`
/// to the last kept one of their session, as map/spacing does; all stay when both are 0. At least one stays.
PartialMap partOf(std::shared_ptr<const TrainingMap> map, double gap, double spacing_m = 0.0);

}  // namespace visual_localization

#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace visual_localization {

/// A jump of the robot that nobody tells it about.
struct Kidnapping {
  std::size_t at = 0;  ///< number of images before it
  std::size_t to = 0;  ///< index of the first image after it
};

/// The order in which a run sees the images of a closed round: every step one image, starting at `start`, wrapping
/// at the end, with an optional jump (protocol of Kronfeld et al. (journal), section 6). As many steps as the
/// round has images. Throws std::invalid_argument, naming the allowed range, for an index beyond the round.
std::vector<std::size_t> imageOrder(std::size_t images, std::size_t start, const std::optional<Kidnapping>& kidnapping);

}  // namespace visual_localization

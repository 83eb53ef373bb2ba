#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "evaluation/place_recogniser.h"

namespace visual_localization::test {

/// Places look alike only near each other.
inline std::vector<double> rowAt(std::size_t at, std::size_t images, bool closed) {
  std::vector<double> row(images);
  for (std::size_t image = 0; image < images; ++image) {
    const std::size_t direct = image > at ? image - at : at - image;
    const auto distance = static_cast<double>(closed ? std::min(direct, images - direct) : direct);
    row[image] = 0.5 * std::exp(-0.5 * distance * distance);
  }
  return row;
}

/// Uniform up to `most`, added to the row.
inline std::vector<double> noisy(std::vector<double> row, double most, std::mt19937& generator) {
  for (double& similarity : row) {
    similarity += most * static_cast<double>(generator()) / static_cast<double>(std::mt19937::max());
  }
  return row;
}

/// The answer to the last of `steps` images from `from`, one training image an image.
inline Recognition drive(PlaceRecogniser& recogniser, std::size_t from, std::size_t steps, std::size_t images,
                         bool closed) {
  Recognition answer;
  for (std::size_t step = 0; step < steps; ++step) {
    answer = recogniser.update(rowAt((from + step) % images, images, closed));
  }
  return answer;
}

}  // namespace visual_localization::test

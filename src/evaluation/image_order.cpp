#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "evaluation/run.h"

namespace visual_localization {
namespace {

void requireIndex(const std::string& name, std::size_t index, std::size_t images) {
  if (index < images) return;
  throw std::invalid_argument(name + " " + std::to_string(index) + " is not allowed: the drive has images 0 to " +
                              std::to_string(images - 1));
}

}  // namespace

std::vector<std::size_t> imageOrder(std::size_t images, std::size_t start,
                                    const std::optional<Kidnapping>& kidnapping) {
  if (images == 0) return {};
  requireIndex("start index", start, images);
  if (kidnapping) {
    requireIndex("kidnapping at step", kidnapping->at, images);
    requireIndex("kidnapping to image", kidnapping->to, images);
  }
  std::vector<std::size_t> order(images);
  for (std::size_t step = 0; step < images; ++step) {
    const bool kidnapped = kidnapping && step >= kidnapping->at;
    order[step] = (kidnapped ? kidnapping->to + step - kidnapping->at : start + step) % images;
  }
  return order;
}

std::vector<std::size_t> imageOrder(std::size_t images, std::size_t start, const RunShape& shape) {
  if (images == 0) return {};
  requireIndex("start index", start, images);
  const std::size_t left = shape.closed ? images : images - start;
  const std::size_t ahead = shape.longest == 0 ? left : std::min(left, shape.longest);
  const auto travelledAt = [&shape](std::size_t step) {
    return static_cast<std::size_t>(std::floor(static_cast<double>(step) * shape.speed));
  };
  auto steps = static_cast<std::size_t>(std::ceil(static_cast<double>(ahead) / shape.speed));
  if (travelledAt(steps - 1) >= ahead) --steps;  // 21 / 0.7 is a little more than 30
  // Half a closed drive ahead is half of it back, and an open one has nothing ahead of its end.
  const std::size_t back = std::min(images / 2, start + travelledAt(steps / 2));
  const std::size_t carried = shape.closed ? images / 2 : images - back;
  std::vector<std::size_t> order(steps);
  for (std::size_t step = 0; step < steps; ++step) {
    const std::size_t jump = shape.kidnapped && step > 0 && step >= steps / 2 ? carried : 0;
    order[step] = (start + travelledAt(step) + jump) % images;
  }
  return order;
}

std::vector<std::size_t> startImages(std::size_t images, bool closed, std::size_t count) {
  const std::size_t possible = closed ? images : (images + 1) / 2;
  const std::size_t runs = count == 0 ? possible : std::min(count, possible);
  std::vector<std::size_t> starts(runs);
  for (std::size_t i = 0; i < runs; ++i) starts[i] = i * possible / runs;
  return starts;
}

std::vector<std::size_t> startImagesEvery(std::size_t images, bool closed, std::size_t every, std::size_t longest) {
  std::size_t possible = closed ? images : (images + 1) / 2;
  if (!closed && longest > 0 && images >= longest) possible = std::max(possible, images - longest + 1);
  std::vector<std::size_t> starts;
  for (std::size_t i = 0; i < possible; i += every) starts.push_back(i);
  return starts;
}

}  // namespace visual_localization

#include "evaluation/drive_order.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace visual_localization {
namespace {

void requireIndex(const std::string& name, std::size_t index, std::size_t images) {
  if (index < images) return;
  throw std::invalid_argument(name + " " + std::to_string(index) + " is not allowed: the drive has images 0 to " +
                              std::to_string(images - 1));
}

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
  const std::size_t ahead = shape.closed ? images : images - start;
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

}  // namespace visual_localization

#include "visual_localization/evaluation/route.h"

namespace visual_localization {

std::optional<std::size_t> Route::at(std::size_t from, std::ptrdiff_t steps) const {
  const auto images = static_cast<std::ptrdiff_t>(images_);
  const std::ptrdiff_t to = static_cast<std::ptrdiff_t>(from) + steps;
  if (to >= 0 && to < images) return static_cast<std::size_t>(to);
  if (!closed_) return std::nullopt;
  return static_cast<std::size_t>((to % images + images) % images);
}

std::size_t Route::distance(std::size_t a, std::size_t b) const {
  const std::size_t direct = a > b ? a - b : b - a;
  return closed_ ? std::min(direct, images_ - direct) : direct;
}

}  // namespace visual_localization

#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>

namespace visual_localization {

/// The order of the training images along the drive; on a closed route the first follows the last.
class Route {
 public:
  Route(std::size_t images, bool closed) : images_(images), closed_(closed) {}

  std::size_t size() const { return images_; }
  /// The image `steps` after `from`, or before it when negative; nothing beyond the ends of an open route.
  std::optional<std::size_t> at(std::size_t from, std::ptrdiff_t steps) const;
  /// Images between two of them, the shorter way.
  std::size_t distance(std::size_t a, std::size_t b) const;
  /// Calls `visit(image)` once for every image at most `radius` from `centre`, along the route.
  template <class Visit>
  void forEachWithin(std::size_t radius, std::size_t centre, Visit visit) const;

 private:
  std::size_t images_;
  bool closed_;
};

template <class Visit>
void Route::forEachWithin(std::size_t radius, std::size_t centre, Visit visit) const {
  const std::size_t before = std::min(radius, closed_ ? (images_ - 1) / 2 : centre);
  const std::size_t after = std::min(radius, closed_ ? images_ / 2 : images_ - 1 - centre);
  std::size_t image = centre >= before ? centre - before : centre + images_ - before;
  for (std::size_t count = 0; count <= before + after; ++count) {
    visit(image);
    image = image + 1 == images_ ? 0 : image + 1;
  }
}

}  // namespace visual_localization

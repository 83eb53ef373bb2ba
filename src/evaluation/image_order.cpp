#include "visual_localization/evaluation/image_order.h"

#include <stdexcept>
#include <string>

namespace visual_localization {
namespace {

void requireIndex(const std::string& name, std::size_t index, std::size_t images) {
  if (index < images) return;
  throw std::invalid_argument(name + " " + std::to_string(index) + " is not allowed: the round has images 0 to " +
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

}  // namespace visual_localization

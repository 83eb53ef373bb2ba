#include "visual_localization/localization/place_proposal.h"

#include <algorithm>
#include <utility>

namespace visual_localization {

PlaceProposal::PlaceProposal(std::size_t training_images, std::size_t max_images, std::size_t max_kept)
    : training_images_(training_images),
      stride_(training_images / max_images + (training_images % max_images == 0 ? 0 : 1)),
      rounds_(std::clamp<std::size_t>(max_kept / ((training_images + stride_ - 1) / stride_), 1, stride_)) {}

void PlaceProposal::startImage(Weigh weigh) {
  weigh_ = std::move(weigh);
  cumulated_.clear();
}

std::size_t PlaceProposal::draw(Random& random) {
  if (cumulated_.empty()) weighMap();
  const double target = random.uniform(0.0, cumulated_.back());
  const auto found = std::upper_bound(cumulated_.begin(), cumulated_.end(), target);
  const auto last = static_cast<std::size_t>(cumulated_.size() - 1);
  return first_ + stride_ * std::min(last, static_cast<std::size_t>(found - cumulated_.begin()));
}

void PlaceProposal::weighMap() {
  round_ = (round_ + 1) % rounds_;
  first_ = round_ * stride_ / rounds_;
  double total = 0.0;
  for (std::size_t i = first_; i < training_images_; i += stride_) {
    total += weigh_(i);
    cumulated_.push_back(total);
  }
  if (total > 0.0) return;
  for (std::size_t i = 0; i < cumulated_.size(); ++i) cumulated_[i] = static_cast<double>(i + 1);
}

}  // namespace visual_localization

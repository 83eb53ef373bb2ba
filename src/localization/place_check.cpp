#include "visual_localization/localization/place_check.h"

#include <algorithm>

namespace visual_localization {

PlaceCheck::PlaceCheck(const TrainingMap& map, std::size_t max_images, double near_m) : map_(map) {
  configure(max_images, near_m);
}

void PlaceCheck::configure(std::size_t max_images, double near_m) {
  near_m_ = near_m;
  stride_ = (map_.size() + max_images - 1) / max_images;
  rounds_ = std::clamp<std::size_t>(map_.globalsKept() / ((map_.size() + stride_ - 1) / stride_), 1, stride_);
}

double PlaceCheck::ratio(ComparableImage& image, const Eigen::Vector2d& position_m) {
  constexpr std::size_t kNeighbours = 32;  // these are always asked; more of them when their turn comes below
  const auto similarity = [&image](std::size_t i) { return image.compare(FeatureKind::kGlobal, i).similarity; };
  double here = 0.0;
  map_.nearest(position_m, kNeighbours, neighbours_);
  for (const Neighbour& neighbour : neighbours_) {
    if (neighbour.distance_m <= near_m_) here = std::max(here, similarity(neighbour.image));
  }
  double anywhere = here;
  round_ = (round_ + 1) % rounds_;
  for (std::size_t i = round_ * stride_ / rounds_; i < map_.size(); i += stride_) {
    const double value = similarity(i);
    anywhere = std::max(anywhere, value);
    // With several sessions there are more than kNeighbours here, and those are no rivals.
    if ((map_.position_m(i) - position_m).norm() <= near_m_) here = std::max(here, value);
  }
  return anywhere > 0.0 ? here / anywhere : 1.0;
}

}  // namespace visual_localization

#include "localization/focal_check.h"

#include <cmath>

namespace visual_localization {
namespace {

constexpr std::size_t kImages = 20;
constexpr double kLeastSigma = 0.003;  ///< landmarks err alike for neighbouring images
constexpr double kSure = 0.01;         ///< a larger standard deviation of the mean says nothing yet
constexpr double kSigmas = 3.0;

}  // namespace

void FocalCheck::add(double scale, double sigma) {
  if (!std::isfinite(scale) || !std::isfinite(sigma)) return;
  if (images_.size() == kImages) images_.erase(images_.begin());
  images_.push_back({scale, 1.0 / (sigma * sigma + kLeastSigma * kLeastSigma)});
}

double FocalCheck::scale() const {
  double sum = 0.0;
  double weights = 0.0;
  for (const Image& image : images_) {
    sum += image.weight * image.scale;
    weights += image.weight;
  }
  return weights > 0.0 ? sum / weights : 1.0;
}

double FocalCheck::sigma() const {
  double weights = 0.0;
  for (const Image& image : images_) weights += image.weight;
  return 1.0 / std::sqrt(weights);
}

bool FocalCheck::contradicts() const {
  return !images_.empty() && std::abs(scale() - 1.0) > max_error_ + kSigmas * sigma();
}

bool FocalCheck::confirms() const { return !images_.empty() && sigma() <= kSure && !contradicts(); }

}  // namespace visual_localization

#include "visual_localization/features/gaussian_window.h"

#include <cmath>
#include <cstddef>

namespace visual_localization {

void GaussianWindow::set(float sigma_px, int radius) {
  radius_ = radius;
  weights_.reserve(static_cast<std::size_t>(2 * radius + 1) + CacheLine::kFloats);
  float* centre = weights_.data() + radius;
  // The quotient of neighbours is itself a geometric sequence.
  const double exponent = -0.5 / (static_cast<double>(sigma_px) * static_cast<double>(sigma_px));
  const double quotient_step = std::exp(2.0 * exponent);
  double quotient = std::exp(exponent);
  double weight = 1.0;
  for (int i = 0; i <= radius; ++i) {
    centre[i] = centre[-i] = static_cast<float>(weight);
    weight *= quotient;
    quotient *= quotient_step;
  }
}

}  // namespace visual_localization

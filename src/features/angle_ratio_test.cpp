#include "visual_localization/features/angle_ratio_test.h"

namespace visual_localization {

AngleRatioTest::AngleRatioTest(double max_angle_ratio) : max_angle_ratio_(max_angle_ratio) {
  for (std::size_t i = 0; i <= kCells; ++i) {
    bounds_[i] = std::cos(max_angle_ratio * std::acos(static_cast<double>(i) / kCells));
  }
}

bool AngleRatioTest::exactly(float best, float second) const {
  const double nearest = std::acos(std::min(1.0, static_cast<double>(best)));
  const double next = std::acos(std::min(1.0, static_cast<double>(second)));
  return nearest < max_angle_ratio_ * next;
}

}  // namespace visual_localization

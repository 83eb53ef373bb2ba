#include "visual_localization/localizer/course.h"

#include <algorithm>
#include <cmath>

namespace visual_localization {

void Course::add(std::int64_t stamp_ns, const Eigen::Vector2d& position_m) {
  points_.push_back({stamp_ns, position_m});
  if (points_.size() > length_) points_.erase(points_.begin());
}

double Course::residual_m() const {
  if (points_.size() < 3) return 0.0;
  const bool timed = stampsRise();
  const auto count = static_cast<double>(points_.size());
  const auto timeOf = [&](std::size_t i) {
    // From the first image on: differences of stamps are exact, stamps as double would not be.
    return timed ? 1e-9 * static_cast<double>(points_[i].stamp_ns - points_[0].stamp_ns) : static_cast<double>(i);
  };
  double mean_time = 0.0;
  Eigen::Vector2d mean_m = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < points_.size(); ++i) {
    mean_time += timeOf(i) / count;
    mean_m += points_[i].position_m / count;
  }
  double times = 0.0;
  Eigen::Vector2d products = Eigen::Vector2d::Zero();
  double squares = 0.0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const double time = timeOf(i) - mean_time;
    const Eigen::Vector2d offset = points_[i].position_m - mean_m;
    times += time * time;
    products += time * offset;
    squares += offset.squaredNorm();
  }
  return std::sqrt(std::max(0.0, squares - products.squaredNorm() / times) / count);
}

bool Course::stampsRise() const {
  const auto falls = [](const Point& a, const Point& b) { return b.stamp_ns <= a.stamp_ns; };
  return std::adjacent_find(points_.begin(), points_.end(), falls) == points_.end();
}

}  // namespace visual_localization

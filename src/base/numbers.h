#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace visual_localization {

constexpr double kPi = 3.14159265358979323846;

constexpr double toDegrees(double angle_rad) { return angle_rad * 180.0 / kPi; }
constexpr double toRadians(double angle_deg) { return angle_deg * kPi / 180.0; }

/// The shorter way round from one angle to another, radians in [-pi, pi].
inline double angleDifference(double from_rad, double to_rad) { return std::remainder(to_rad - from_rad, 2.0 * kPi); }

/// Whether two images taken at the same position, that look these ways, can show the same.
inline bool faceAlike(double yaw_rad, double other_yaw_rad) {
  constexpr double kSameView_rad = 0.5 * kPi;
  return std::abs(angleDifference(yaw_rad, other_yaw_rad)) <= kSameView_rad;
}

/// Of a normal distribution, its largest value 1.
inline double gaussian(double deviation, double sigma) {
  return std::exp(-0.5 * deviation * deviation / (sigma * sigma));
}

/// The middle value; of an even number the mean of the two in the middle; 0 of none.
inline double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

/// The middle value; of an even number the larger of the two in the middle, so that it is always one of the values.
/// The datum and cleaned path of a map and the scale of a match are defined by it. Reorders `values`, of which there
/// must be one.
template <class T>
T upperMedian(std::vector<T>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The smallest value that at least `share` of all are not above (nearest rank): always one of the values. Reorders
/// `values`, of which there must be one.
inline double nearestRank(std::vector<double>& values, double share) {
  const auto rank = static_cast<std::ptrdiff_t>(std::ceil(share * static_cast<double>(values.size())));
  const auto found = values.begin() + std::max<std::ptrdiff_t>(1, rank) - 1;
  std::nth_element(values.begin(), found, values.end());
  return *found;
}

/// Of `count` items every so many-th is taken, so that at most `most` are: at least 1.
constexpr std::size_t strideFor(std::size_t count, std::size_t most) {
  return count <= most ? 1 : (count + most - 1) / most;
}

/// Value below which `share` of the sorted values lie, linear between neighbours.
inline double quantile(const std::vector<double>& sorted, double share) {
  const double rank = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(rank);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (rank - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

}  // namespace visual_localization

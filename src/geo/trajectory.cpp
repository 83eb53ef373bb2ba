#include "visual_localization/geo/trajectory.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "base/angles.h"
#include "base/time.h"

namespace visual_localization {

Trajectory::Trajectory(std::vector<TrajectoryPoint> points, double max_gap_s)
    : points_(std::move(points)), max_gap_s_(max_gap_s) {
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (!points_[i].position_m.allFinite() || !std::isfinite(points_[i].yaw_rad)) {
      throw std::invalid_argument("trajectory: point " + std::to_string(i) + " is not finite");
    }
    if (i > 0 && points_[i].stamp_ns <= points_[i - 1].stamp_ns) {
      throw std::invalid_argument("trajectory: point " + std::to_string(i) + " is not later than the one before");
    }
  }
}

std::optional<TrajectoryPoint> Trajectory::at(std::int64_t stamp_ns) const {
  const auto after = std::lower_bound(points_.begin(), points_.end(), stamp_ns,
                                      [](const TrajectoryPoint& point, std::int64_t t) { return point.stamp_ns < t; });
  if (after == points_.end()) return std::nullopt;
  if (after->stamp_ns == stamp_ns) return *after;
  if (after == points_.begin()) return std::nullopt;
  const auto before = std::prev(after);
  if (isGap(*before, *after)) return std::nullopt;
  const double share = secondsBetween(before->stamp_ns, stamp_ns) / secondsBetween(before->stamp_ns, after->stamp_ns);
  TrajectoryPoint point;
  point.stamp_ns = stamp_ns;
  point.position_m = before->position_m + share * (after->position_m - before->position_m);
  point.yaw_rad = std::remainder(before->yaw_rad + share * angleDifference(before->yaw_rad, after->yaw_rad), 2.0 * kPi);
  return point;
}

double Trajectory::length() const {
  double sum_m = 0.0;
  for (std::size_t i = 1; i < points_.size(); ++i) {
    if (!isGap(points_[i - 1], points_[i])) sum_m += (points_[i].position_m - points_[i - 1].position_m).norm();
  }
  return sum_m;
}

bool Trajectory::isGap(const TrajectoryPoint& before, const TrajectoryPoint& after) const {
  return secondsBetween(before.stamp_ns, after.stamp_ns) > max_gap_s_;
}

}  // namespace visual_localization

#include "visual_localization/localization/odometry.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>

#include "base/numbers.h"
#include "base/time.h"

namespace visual_localization {
namespace {

constexpr double kFastestTurn_rad_s = 2.0 * kPi;
constexpr std::size_t kMostReadings = 20'000;  ///< at 100 Hz those of 200 s

/// `share`: 0 at `a`, 1 at `b`; beyond it the motion goes on.
OdometryReading interpolated(const OdometryReading& a, const OdometryReading& b, double share, std::int64_t stamp_ns) {
  return {stamp_ns, a.position_m + share * (b.position_m - a.position_m),
          a.yaw_rad + share * angleDifference(a.yaw_rad, b.yaw_rad)};
}

}  // namespace

void OdometryConfig::declare(ParameterVisitor& visitor) {
  visitor.real({"odometry/distance_sigma", "1", "standard deviation of a position by odometry, share of the way"},
               distance_sigma, 0.0001, 1.0);
  visitor.real({"odometry/turn_sigma", "rad/m", "standard deviation of a heading by odometry, per metre driven"},
               turn_sigma_rad_m, 0.0, 1.0);
}

void OdometryTrack::add(const OdometryReading& reading) {
  if (!reading.position_m.allFinite() || !std::isfinite(reading.yaw_rad)) {
    throw std::invalid_argument("its pose is not finite");
  }
  if (!points_.empty() && reading.stamp_ns <= points_.back().at.stamp_ns) {
    if (secondsBetween(reading.stamp_ns, points_.back().at.stamp_ns) <= kLate_s) return;
    points_.clear();
  }
  Point point{reading, 0.0, false};
  if (!points_.empty()) {
    const Point& before = points_.back();
    const double step_m = (reading.position_m - before.at.position_m).norm();
    const double step_s = secondsBetween(before.at.stamp_ns, reading.stamp_ns);
    const double turn_rad = std::abs(angleDifference(before.at.yaw_rad, reading.yaw_rad));
    point.joined = step_s <= config_.max_gap_s && step_m <= config_.max_speed_mps * step_s &&
                   turn_rad <= kFastestTurn_rad_s * step_s;
    point.way_m = before.way_m + step_m;
  }
  points_.push_back(point);
  if (points_.size() > kMostReadings) points_.pop_front();
}

std::optional<OdometryTrack::Point> OdometryTrack::pointAt(std::int64_t stamp_ns) const {
  if (points_.size() < 2 || stamp_ns < points_.front().at.stamp_ns) return std::nullopt;
  if (secondsBetween(points_.back().at.stamp_ns, stamp_ns) > config_.max_gap_s) return std::nullopt;
  auto after = std::lower_bound(points_.begin() + 1, points_.end(), stamp_ns,
                                [](const Point& point, std::int64_t ns) { return point.at.stamp_ns < ns; });
  if (after == points_.end()) --after;
  const Point& before = *(after - 1);
  const double share =
      secondsBetween(before.at.stamp_ns, stamp_ns) / secondsBetween(before.at.stamp_ns, after->at.stamp_ns);
  return Point{interpolated(before.at, after->at, share, stamp_ns),
               before.way_m + share * (after->way_m - before.way_m), after->joined};
}

std::optional<OdometryIncrement> OdometryTrack::between(std::int64_t from_ns, std::int64_t to_ns) const {
  if (from_ns > to_ns) return std::nullopt;
  const std::optional<Point> from = pointAt(from_ns);
  const std::optional<Point> to = pointAt(to_ns);
  if (!from || !to || !from->joined || !to->joined) return std::nullopt;
  const auto isBefore = [](std::int64_t ns, const Point& point) { return ns < point.at.stamp_ns; };
  const auto begin = std::upper_bound(points_.begin(), points_.end(), from_ns, isBefore);
  const auto end = std::upper_bound(points_.begin(), points_.end(), to_ns, isBefore);
  if (!std::all_of(begin, end, [](const Point& point) { return point.joined; })) return std::nullopt;
  OdometryIncrement increment;
  increment.translation_m = Eigen::Rotation2Dd(-from->at.yaw_rad) * (to->at.position_m - from->at.position_m);
  increment.rotation_rad = angleDifference(from->at.yaw_rad, to->at.yaw_rad);
  increment.distance_m = std::max(0.0, to->way_m - from->way_m);
  return increment;
}

}  // namespace visual_localization

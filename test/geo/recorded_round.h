#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "base/numbers.h"
#include "base/time.h"
#include "visual_localization/geo/trajectory_cleaner.h"

/// Rounds as a receiver records them, and what cleaning makes of them.
namespace visual_localization::test {

inline constexpr double kSpeed = 0.65;  // m/s
inline constexpr double kRate = 5.0;    // fixes per second
inline const GeodeticPoint kDatum{48.5345, 9.0713, 445.0};

using Path = std::function<Eigen::Vector2d(double time_s)>;

/// Around a block of 60 m x 40 m with corners of 5 m radius, counter-clockwise.
inline Eigen::Vector2d block(double time_s) {
  const double length_m = 50.0;
  const double width_m = 30.0;
  const double radius_m = 5.0;
  const double arc_m = radius_m * kPi / 2.0;
  double along_m = std::fmod(kSpeed * time_s, 2.0 * (length_m + width_m) + 4.0 * arc_m);
  Eigen::Vector2d position(0.0, 0.0);
  double yaw_rad = 0.0;
  for (const double side_m : {length_m, width_m, length_m, width_m}) {
    const Eigen::Vector2d ahead(std::cos(yaw_rad), std::sin(yaw_rad));
    const Eigen::Vector2d left(-ahead.y(), ahead.x());
    if (along_m < side_m) return position + along_m * ahead;
    position += side_m * ahead;
    along_m -= side_m;
    const double turned_rad = std::min(along_m, arc_m) / radius_m;
    const Eigen::Vector2d turned = radius_m * (std::sin(turned_rad) * ahead + (1.0 - std::cos(turned_rad)) * left);
    if (along_m < arc_m) return position + turned;
    position += turned;
    along_m -= arc_m;
    yaw_rad += kPi / 2.0;
  }
  return position;
}

constexpr std::int64_t kBegin_ns = 1'226'500'000'000'000'000;  ///< of a round, in November 2008

/// Of a moment so many seconds after the begin.
inline std::int64_t stampOf(double time_s) { return kBegin_ns + static_cast<std::int64_t>(time_s * 1e9); }

/// A round that a receiver with 12 cm of noise recorded.
inline std::vector<Fix> record(const Path& path, double duration_s, double rate_hz = kRate, double noise_m = 0.12) {
  std::mt19937 engine(17);
  std::normal_distribution<double> noise(0.0, 1.0);
  const LocalFrame frame(kDatum);
  std::vector<Fix> fixes;
  for (double time_s = 0.0; time_s < duration_s; time_s += 1.0 / rate_hz) {
    const double x = noise(engine);
    const Eigen::Vector2d position = path(time_s) + noise_m * Eigen::Vector2d(x, noise(engine));
    fixes.push_back({stampOf(time_s), frame.toGeodetic(position), true});
  }
  return fixes;
}

inline double timeOf(const Fix& fix) { return secondsBetween(kBegin_ns, fix.stamp_ns); }

inline void shift(Fix& fix, const Eigen::Vector2d& offset_m) {
  const LocalFrame frame(kDatum);
  fix.position = frame.toGeodetic(frame.toEastNorth(fix.position) + offset_m);
}

inline CleanedTrajectory clean(const std::vector<Fix>& fixes) {
  return cleanTrajectory(fixes, LocalFrame(kDatum), TrajectoryCleanerConfig());
}

/// Distances from the true path at every second, where the cleaned one is known.
inline std::vector<double> errorsOf(const CleanedTrajectory& cleaned, const Path& path, double duration_s) {
  std::vector<double> errors_m;
  for (double time_s = 0.5; time_s < duration_s - 1.0; time_s += 1.0) {
    const auto point = cleaned.trajectory.at(stampOf(time_s));
    if (point) errors_m.push_back((point->position_m - path(time_s)).norm());
  }
  return errors_m;
}

inline double meanOf(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

inline double largestOf(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }

inline std::size_t countOf(const CleanedTrajectory& cleaned, FixVerdict verdict) {
  return static_cast<std::size_t>(std::count(cleaned.verdicts.begin(), cleaned.verdicts.end(), verdict));
}

}  // namespace visual_localization::test

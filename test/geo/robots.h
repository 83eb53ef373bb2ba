#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "test/geo/recorded_round.h"

/// Robots and receivers of all kinds, and what these record of those.
namespace visual_localization::test {

/// By its speed and its turn rate at each time, in steps of 50 ms.
inline Path driven(double duration_s, const std::function<double(double)>& speed_mps,
                   const std::function<double(double)>& rate_rad_s) {
  constexpr double kStep_s = 0.05;
  std::vector<Eigen::Vector2d> positions_m{{0.0, 0.0}};
  double yaw_rad = 0.3;
  for (double time_s = 0.0; time_s < duration_s + 1.0; time_s += kStep_s) {
    yaw_rad += kStep_s * rate_rad_s(time_s);
    const Eigen::Vector2d ahead(std::cos(yaw_rad), std::sin(yaw_rad));
    positions_m.emplace_back(positions_m.back() + kStep_s * speed_mps(time_s) * ahead);
  }
  return [positions_m](double time_s) -> Eigen::Vector2d {
    const double step = std::max(0.0, time_s / kStep_s);
    const auto left = std::min(static_cast<std::size_t>(step), positions_m.size() - 2);
    return positions_m[left] + (step - static_cast<double>(left)) * (positions_m[left + 1] - positions_m[left]);
  };
}

constexpr double kDrive_s = 600.0;

/// Stops at lights, turns at crossings.
inline Path car() {
  const auto phase = [](double time_s) { return std::fmod(time_s, 75.0); };
  return driven(
      kDrive_s,
      [phase](double time_s) {
        const double t = phase(time_s);
        return t < 20.0 ? 0.0 : std::min({2.0 * (t - 20.0), 12.0, 2.5 * (75.0 - t)});
      },
      [phase](double time_s) { return phase(time_s) > 60.0 && phase(time_s) < 64.0 ? 0.4 : 0.01; });
}

/// Straight rows with a stop and a turn on the spot at each end.
inline Path mower() {
  const auto phase = [](double time_s) { return std::fmod(time_s, 60.0); };
  return driven(
      kDrive_s, [phase](double time_s) { return phase(time_s) < 50.0 ? 0.6 : 0.0; },
      [phase](double time_s) { return phase(time_s) > 52.0 && phase(time_s) < 57.0 ? 0.2 * kPi : 0.0; });
}

inline Path walker() {
  return driven(
      kDrive_s, [](double time_s) { return 1.3 + 0.4 * std::sin(time_s / 9.0) + 0.2 * std::sin(time_s / 2.3); },
      [](double time_s) { return 0.25 * std::sin(time_s / 17.0); });
}

/// Stands for more than half of the time, and then drives.
inline Path parkedCar() {
  return [drive = car()](double time_s) { return drive(std::max(0.0, time_s - 350.0)); };
}

/// At one speed, but for half a minute.
inline Path slowForAWhile() {
  return driven(
      kDrive_s, [](double time_s) { return time_s > 200.0 && time_s < 236.0 ? 0.3 : 0.65; },
      [](double time_s) { return std::fmod(time_s, 60.0) < 4.0 ? 0.4 : 0.0; });
}

/// To five decimals, about a metre.
inline void roundCoordinates(Fix& fix) {
  fix.position.latitude_deg = std::round(fix.position.latitude_deg * 1e5) / 1e5;
  fix.position.longitude_deg = std::round(fix.position.longitude_deg * 1e5) / 1e5;
}

/// White noise and a Gauss-Markov error, metres and seconds.
struct Receiver {
  std::string name;
  double rate_hz = 1.0;
  double white_m = 0.0;
  double slow_m = 0.0;
  double correlation_s = 100.0;
  double sigma_m = 0.0;  ///< as it claims
};

inline const std::vector<Receiver> kReceivers{{"geodetic", 10.0, 0.02, 1.0, 200.0, 0.0},
                                              {"u-blox", 5.0, 0.1, 1.2, 100.0, 1.5},
                                              {"telephone", 1.0, 1.5, 3.0, 40.0, 0.0},
                                              {"fixed", 5.0, 0.01, 0.0, 1.0, 0.02},
                                              {"slow", 0.5, 0.3, 1.0, 120.0, 0.0}};

inline std::vector<Fix> recordedBy(const Path& path, const Receiver& receiver, std::uint32_t seed = 5) {
  std::vector<Fix> fixes = record(path, kDrive_s, receiver.rate_hz, receiver.white_m);
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal;
  const double kept = std::exp(-1.0 / (receiver.rate_hz * receiver.correlation_s));
  Eigen::Vector2d error_m(0.0, 0.0);
  for (Fix& fix : fixes) {
    const double x = normal(engine);
    error_m = kept * error_m + receiver.slow_m * std::sqrt(1.0 - kept * kept) * Eigen::Vector2d(x, normal(engine));
    shift(fix, error_m);
    fix.sigma_m = receiver.sigma_m;
  }
  return fixes;
}

/// Of the raw fixes, interpolated, where errorsOf() judges.
inline double rawError_m(const std::vector<Fix>& fixes, const Path& path) {
  const LocalFrame frame(kDatum);
  std::vector<TrajectoryPoint> points;
  for (const Fix& fix : fixes) points.push_back({fix.stamp_ns, frame.toEastNorth(fix.position), 0.0});
  CleanedTrajectory raw;
  raw.trajectory = Trajectory(points);
  return meanOf(errorsOf(raw, path, kDrive_s));
}

}  // namespace visual_localization::test

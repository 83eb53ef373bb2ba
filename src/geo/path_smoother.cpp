#include "geo/path_smoother.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <Eigen/Cholesky>

#include "base/numbers.h"
#include "geo/motion_scales.h"

namespace visual_localization {
namespace {

/// Position, velocity and lasting error: one column an axis, and the covariance that both axes share.
struct State {
  Eigen::Matrix<double, 3, 2> mean = Eigen::Matrix<double, 3, 2>::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

/// From one measurement to the next.
struct Transition {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d noise = Eigen::Matrix3d::Zero();
};

double squareOf(double value) { return value * value; }

Transition transition(const Measurement& from, const Measurement& to, double density) {
  const double elapsed_s = to.sample.time_s - from.sample.time_s;
  Transition found;
  found.matrix(0, 1) = elapsed_s;
  found.noise(0, 0) = density * elapsed_s * elapsed_s * elapsed_s / 3.0;
  found.noise(0, 1) = found.noise(1, 0) = density * elapsed_s * elapsed_s / 2.0;
  found.noise(1, 1) = density * elapsed_s;
  if (to.steps) {
    found.matrix(2, 2) = 0.0;
    found.noise(2, 2) = squareOf(to.offset_m);
  }
  return found;
}

State startAt(const Measurement& first, double usual_mps) {
  constexpr double kAnywhere = 10.0;
  State state;
  state.mean.row(0) = first.sample.position_m.transpose();
  state.covariance.diagonal() << squareOf(kAnywhere * (first.offset_m + first.white_m)), squareOf(usual_mps),
      squareOf(first.offset_m);
  return state;
}

void update(const Measurement& measurement, State& state) {
  const Eigen::RowVector3d seen(1.0, 0.0, 1.0);
  const Eigen::Vector3d shared = state.covariance * seen.transpose();
  const Eigen::Vector3d gain = shared / (seen * shared + squareOf(measurement.white_m));
  state.mean += gain * (measurement.sample.position_m.transpose() - seen * state.mean);
  const Eigen::Matrix3d rest = Eigen::Matrix3d::Identity() - gain * seen;
  state.covariance =
      rest * state.covariance * rest.transpose() + squareOf(measurement.white_m) * gain * gain.transpose();
}

PathState pathState(double time_s, const State& state) {
  const Eigen::Matrix3d& covariance = state.covariance;
  PathState at;
  at.time_s = time_s;
  at.position_m = state.mean.row(0);
  at.velocity_mps = state.mean.row(1);
  at.offset_m = state.mean.row(2);
  at.position_var = std::max(0.0, covariance(0, 0));
  at.velocity_var = std::max(0.0, covariance(1, 1));
  at.reading_var = std::max(0.0, covariance(0, 0) + 2.0 * covariance(0, 2) + covariance(2, 2));
  return at;
}

std::vector<PathState> smooth(const std::vector<Measurement>& measurements, const Motion& motion) {
  const std::size_t count = measurements.size();
  std::vector<State> predicted(count);
  std::vector<State> filtered(count);
  std::vector<Transition> transitions(count);  // to each from the one before
  for (std::size_t i = 0; i < count; ++i) {
    if (i == 0) {
      predicted[0] = startAt(measurements[0], motion.usual_mps);
    } else {
      transitions[i] = transition(measurements[i - 1], measurements[i], motion.acceleration_density);
      const Eigen::Matrix3d& matrix = transitions[i].matrix;
      predicted[i].mean = matrix * filtered[i - 1].mean;
      predicted[i].covariance = matrix * filtered[i - 1].covariance * matrix.transpose() + transitions[i].noise;
    }
    filtered[i] = predicted[i];
    update(measurements[i], filtered[i]);
  }
  std::vector<PathState> path(count);
  State smoothed = filtered.back();
  path.back() = pathState(measurements.back().sample.time_s, smoothed);
  for (std::size_t i = count - 1; i-- > 0;) {
    const State& next = predicted[i + 1];
    const Eigen::Matrix3d gain =
        next.covariance.ldlt().solve(transitions[i + 1].matrix * filtered[i].covariance).transpose();
    smoothed.mean = filtered[i].mean + gain * (smoothed.mean - next.mean);
    smoothed.covariance = filtered[i].covariance + gain * (smoothed.covariance - next.covariance) * gain.transpose();
    path[i] = pathState(measurements[i].sample.time_s, smoothed);
  }
  return path;
}

std::size_t endOfStretch(const std::vector<Measurement>& measurements, std::size_t begin) {
  std::size_t end = begin + 1;
  while (end < measurements.size() && !measurements[end].steps) ++end;
  return end;
}

/// What a receiver promises varies a little all the time; where it changes much its error is another one.
void splitByPromises(std::vector<Measurement>& measurements) {
  constexpr double kMuch = 5.0;
  double promised_m = measurements.front().offset_m;
  for (Measurement& measurement : measurements) {
    const double ratio = measurement.offset_m / promised_m;
    if (ratio > kMuch || ratio < 1.0 / kMuch) measurement.steps = true;
    if (measurement.steps) promised_m = measurement.offset_m;
  }
  std::size_t end = 0;
  for (std::size_t begin = 0; begin < measurements.size(); begin = end) {
    end = endOfStretch(measurements, begin);
    std::vector<double> promises_m;
    for (std::size_t i = begin; i < end; ++i) promises_m.push_back(measurements[i].offset_m);
    const double usual_m = median(std::move(promises_m));
    for (std::size_t i = begin; i < end; ++i) measurements[i].offset_m = usual_m;
  }
}

/// A receiver that steps aside for a while is worse for that while: the shorter a stretch between two steps and the
/// farther off it came out, the less it says about where the path is. `path`: as it came out; empty at first.
void weighStretches(const std::vector<Measurement>& said, const std::vector<PathState>& path,
                    std::vector<Measurement>& measurements) {
  constexpr double kLeastWeight = 0.1;  // or else one stretch after the other could lose its say
  const double interval_s = (said.back().sample.time_s - said.front().sample.time_s) / static_cast<double>(said.size());
  const auto duration_s = [&](std::size_t begin) {
    return said[endOfStretch(said, begin) - 1].sample.time_s - said[begin].sample.time_s + interval_s;
  };
  double longest_s = 0.0;
  for (std::size_t begin = 0; begin < said.size(); begin = endOfStretch(said, begin)) {
    longest_s = std::max(longest_s, duration_s(begin));
  }
  std::size_t end = 0;
  for (std::size_t begin = 0; begin < said.size(); begin = end) {
    end = endOfStretch(said, begin);
    double squared = 0.0;
    for (std::size_t i = begin; i < end && !path.empty(); ++i) {
      squared += path[i].offset_m.squaredNorm() / squareOf(said[i].offset_m) / static_cast<double>(end - begin);
    }
    const double factor = std::sqrt(longest_s / duration_s(begin) / std::max(kLeastWeight, studentWeight(squared)));
    for (std::size_t i = begin; i < end; ++i) measurements[i].offset_m = factor * said[i].offset_m;
  }
}

/// At most what a cubic between the ends of a way may have without swinging (Fritsch and Carlson).
Eigen::Vector2d limited(const Eigen::Vector2d& velocity_mps, double mean_mps) {
  constexpr double kMost = 3.0;
  const double speed_mps = velocity_mps.norm();
  return speed_mps <= kMost * mean_mps ? velocity_mps : Eigen::Vector2d(velocity_mps * (kMost * mean_mps / speed_mps));
}

}  // namespace

std::vector<PathState> smoothPath(std::vector<Measurement> measurements, const Motion& motion) {
  constexpr int kIterations = 4;
  constexpr double kNoWeight = 1e3;
  splitByPromises(measurements);
  const std::vector<Measurement> said = measurements;
  const bool steps = endOfStretch(said, 0) < said.size();
  bool doubts = false;
  for (Measurement& measurement : measurements) {
    if (!measurement.doubtful) continue;
    doubts = true;
    measurement.white_m = kNoWeight * (measurement.white_m + measurement.offset_m);
  }
  if (steps) weighStretches(said, {}, measurements);
  std::vector<PathState> path = smooth(measurements, motion);
  for (int iteration = 0; (doubts || steps) && iteration < kIterations; ++iteration) {
    if (steps) weighStretches(said, path, measurements);
    for (std::size_t i = 0; i < said.size(); ++i) {
      if (!said[i].doubtful) continue;
      const double away_m = (said[i].sample.position_m - path[i].position_m).norm() / std::sqrt(2.0);
      measurements[i].white_m = std::max(said[i].white_m, away_m);
    }
    path = smooth(measurements, motion);
  }
  return path;
}

PathState between(const PathState& before, const PathState& after, double time_s) {
  const double elapsed_s = after.time_s - before.time_s;
  const double share = (time_s - before.time_s) / elapsed_s;
  const double rest = 1.0 - share;
  const Eigen::Vector2d way_m = after.position_m - before.position_m;
  const Eigen::Vector2d first_mps = limited(before.velocity_mps, way_m.norm() / elapsed_s);
  const Eigen::Vector2d last_mps = limited(after.velocity_mps, way_m.norm() / elapsed_s);
  PathState at = share < 0.5 ? before : after;
  at.time_s = time_s;
  at.position_m = before.position_m + share * share * (3.0 - 2.0 * share) * way_m +
                  share * rest * elapsed_s * (rest * first_mps - share * last_mps);
  at.velocity_mps = 6.0 * share * rest / elapsed_s * way_m + rest * (1.0 - 3.0 * share) * first_mps +
                    share * (3.0 * share - 2.0) * last_mps;
  at.offset_m = rest * before.offset_m + share * after.offset_m;
  return at;
}

Reading readingAt(const std::vector<PathState>& path, const Motion& motion, double time_s) {
  const auto after = std::lower_bound(path.begin(), path.end(), time_s,
                                      [](const PathState& state, double at_s) { return state.time_s < at_s; });
  if (after == path.begin() || after == path.end()) {
    const PathState& end = after == path.end() ? path.back() : path.front();
    const double beyond_s = std::abs(time_s - end.time_s);
    return {end.position_m + (time_s - end.time_s) * end.velocity_mps + end.offset_m,
            end.reading_var + beyond_s * beyond_s * (end.velocity_var + motion.acceleration_density * beyond_s / 3.0)};
  }
  const PathState& before = *(after - 1);
  const PathState at = between(before, *after, time_s);
  const double elapsed_s = after->time_s - before.time_s;
  const double share = (time_s - before.time_s) / elapsed_s;
  const double turned_s = elapsed_s * share * (1.0 - share);
  return {at.position_m + at.offset_m, (1.0 - share) * before.reading_var + share * after->reading_var +
                                           motion.acceleration_density * turned_s * turned_s * turned_s / 3.0};
}

}  // namespace visual_localization

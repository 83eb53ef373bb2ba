#include "geo/path_smoother.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <Eigen/Cholesky>

#include "geo/lasting_errors.h"

namespace visual_localization {
namespace {

/// Position, velocity, lasting error and that of what is aside: one column an axis, and the covariance that both axes
/// share.
struct State {
  Eigen::Matrix<double, 4, 2> mean = Eigen::Matrix<double, 4, 2>::Zero();
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
};

/// From one measurement to the next.
struct Transition {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  Eigen::Matrix4d noise = Eigen::Matrix4d::Zero();
};

/// What is known of the error of a measurement that is aside.
struct Aside {
  double sigma_m = 0.0;  ///< along one axis
  double density = 0.0;  ///< of its change, m^2/s
};

double squareOf(double value) { return value * value; }

/// Of the change of an error of this size: of multipath, which is another one after about a minute.
double densityOf(double sigma_m) {
  constexpr double kLasts_s = 60.0;
  return 2.0 / kLasts_s * squareOf(sigma_m);
}

Transition transition(const Measurement& from, const Measurement& to, const Aside& aside, double density) {
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
  if (!to.aside || !from.aside) found.matrix(3, 3) = 0.0;
  if (to.aside) found.noise(3, 3) = from.aside ? aside.density * elapsed_s : squareOf(aside.sigma_m);
  return found;
}

State startAt(const Measurement& first, double usual_mps) {
  constexpr double kAnywhere = 10.0;
  State state;
  state.mean.row(0) = first.sample.position_m.transpose();
  state.covariance.diagonal() << squareOf(kAnywhere * (first.offset_m + first.white_m)), squareOf(usual_mps),
      squareOf(first.offset_m), 0.0;
  return state;
}

void update(const Measurement& measurement, State& state) {
  const Eigen::RowVector4d seen(1.0, 0.0, 1.0, measurement.aside ? 1.0 : 0.0);
  const Eigen::Vector4d shared = state.covariance * seen.transpose();
  const Eigen::Vector4d gain = shared / (seen * shared + squareOf(measurement.white_m));
  state.mean += gain * (measurement.sample.position_m.transpose() - seen * state.mean);
  const Eigen::Matrix4d rest = Eigen::Matrix4d::Identity() - gain * seen;
  state.covariance =
      rest * state.covariance * rest.transpose() + squareOf(measurement.white_m) * gain * gain.transpose();
}

PathState pathState(double time_s, const State& state) {
  const Eigen::Matrix4d& covariance = state.covariance;
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

std::vector<PathState> smooth(const std::vector<Measurement>& measurements, const std::vector<Aside>& asides,
                              const Motion& motion) {
  const std::size_t count = measurements.size();
  std::vector<State> predicted(count);
  std::vector<State> filtered(count);
  std::vector<Transition> transitions(count);  // to each from the one before
  for (std::size_t i = 0; i < count; ++i) {
    if (i == 0) {
      predicted[0] = startAt(measurements[0], motion.usual_mps);
    } else {
      transitions[i] = transition(measurements[i - 1], measurements[i], asides[i], motion.acceleration_density);
      const Eigen::Matrix4d& matrix = transitions[i].matrix;
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
    const Eigen::Matrix4d gain =
        next.covariance.ldlt().solve(transitions[i + 1].matrix * filtered[i].covariance).transpose();
    smoothed.mean = filtered[i].mean + gain * (smoothed.mean - next.mean);
    smoothed.covariance = filtered[i].covariance + gain * (smoothed.covariance - next.covariance) * gain.transpose();
    path[i] = pathState(measurements[i].sample.time_s, smoothed);
  }
  return path;
}

/// At first nothing is known of how far they are aside.
std::vector<Aside> unknownAsides(const std::vector<Measurement>& said) {
  constexpr double kAnywhere = 1e3;
  std::vector<Aside> asides(said.size());
  for (std::size_t i = 0; i < said.size(); ++i) {
    if (said[i].aside) asides[i].sigma_m = kAnywhere * (said[i].white_m + said[i].offset_m);
    asides[i].density = densityOf(asides[i].sigma_m);
  }
  return asides;
}

/// Measurements in a row that are aside are as good as they are near to the path, and their error changes as they show:
/// that of spikes all the time, that of a receiver that jumps never.
void learnAsides(const std::vector<Measurement>& said, const std::vector<PathState>& path, std::vector<Aside>& asides) {
  const auto error_m = [&](std::size_t i) -> Eigen::Vector2d {
    return said[i].sample.position_m - path[i].position_m - path[i].offset_m;
  };
  std::size_t end = 0;
  for (std::size_t begin = 0; begin < said.size(); begin = std::max(end, begin + 1)) {
    double squares = 0.0;
    double changes = 0.0;
    for (end = begin; end < said.size() && said[end].aside; ++end) {
      squares += error_m(end).squaredNorm() / 2.0;
      if (end == begin) continue;
      const double elapsed_s = said[end].sample.time_s - said[end - 1].sample.time_s;
      changes += (error_m(end) - error_m(end - 1)).squaredNorm() / 2.0 / elapsed_s;
    }
    if (end == begin) continue;
    const auto count = static_cast<double>(end - begin);
    const double sigma_m = std::max(said[begin].offset_m, std::sqrt(squares / count));
    const double density = std::max(densityOf(sigma_m), changes / std::max(1.0, count - 1.0));
    std::fill(asides.begin() + static_cast<std::ptrdiff_t>(begin), asides.begin() + static_cast<std::ptrdiff_t>(end),
              Aside{sigma_m, density});
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
  constexpr int kMostDrops = 10;  // an hour of hostile steps takes seconds
  splitByPromises(measurements);
  std::vector<Measurement> said = measurements;
  std::vector<Aside> asides = unknownAsides(said);
  bool steps = false;
  int drops = 0;
  std::vector<PathState> path;
  do {
    measurements = said;
    steps = hasSteps(said);
    if (steps) weighStretches(said, {}, measurements);
    path = smooth(measurements, asides, motion);
  } while (steps && drops++ < kMostDrops && dropUntold(path, said));
  const bool doubts =
      std::any_of(said.begin(), said.end(), [](const Measurement& measurement) { return measurement.aside; });
  for (int iteration = 0; (doubts || steps) && iteration < kIterations; ++iteration) {
    if (steps) weighStretches(said, path, measurements);
    learnAsides(said, path, asides);
    path = smooth(measurements, asides, motion);
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
  return at;
}

Reading readingAt(const std::vector<PathState>& path, const Motion& motion, const PathSample& seen) {
  const double time_s = seen.time_s;
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
  const Eigen::Vector2d one_m = at.position_m + before.offset_m;
  const Eigen::Vector2d other_m = at.position_m + after->offset_m;
  const bool is_one = (seen.position_m - one_m).squaredNorm() <= (seen.position_m - other_m).squaredNorm();
  return {is_one ? one_m : other_m, (1.0 - share) * before.reading_var + share * after->reading_var +
                                        motion.acceleration_density * turned_s * turned_s * turned_s / 3.0};
}

}  // namespace visual_localization

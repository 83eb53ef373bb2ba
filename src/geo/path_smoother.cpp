#include "geo/path_smoother.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

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
  double promised_m = measurements.front().offset_m;
  for (Measurement& measurement : measurements) {
    const double ratio = measurement.offset_m / promised_m;
    if (ratio > kOtherPromise || ratio < 1.0 / kOtherPromise) measurement.steps = true;
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

/// Measurements between two steps, which share one lasting error.
struct Stretch {
  std::size_t begin = 0;
  std::size_t end = 0;
  double duration_s = 0.0;
  Eigen::Vector2d offset_m = Eigen::Vector2d::Zero();  ///< the lasting error as the path has it
};

std::vector<Stretch> stretchesOf(const std::vector<Measurement>& said, const std::vector<PathState>& path) {
  const double interval_s = (said.back().sample.time_s - said.front().sample.time_s) / static_cast<double>(said.size());
  std::vector<Stretch> stretches;
  for (std::size_t begin = 0; begin < said.size(); begin = stretches.back().end) {
    Stretch stretch{begin, endOfStretch(said, begin)};
    stretch.duration_s = said[stretch.end - 1].sample.time_s - said[begin].sample.time_s + interval_s;
    if (!path.empty()) stretch.offset_m = path[begin].offset_m;
    stretches.push_back(stretch);
  }
  return stretches;
}

/// Whether the receiver promises about the same in all of them, so that its promises do not tell which are good.
bool arePromisedAlike(const std::vector<Stretch>& stretches, const std::vector<Measurement>& said) {
  double least_m = said.front().offset_m;
  double most_m = least_m;
  for (const Stretch& stretch : stretches) {
    least_m = std::min(least_m, said[stretch.begin].offset_m);
    most_m = std::max(most_m, said[stretch.begin].offset_m);
  }
  return most_m <= kOtherPromise * least_m;
}

/// Whether the receiver comes back to an error that it left: then it is known which of its errors is aside.
bool comesBack(const std::vector<Stretch>& stretches) {
  constexpr double kNear = 0.5;  // of the smallest step in between
  for (std::size_t i = 0; i + 2 < stretches.size(); ++i) {
    double smallest_m = (stretches[i + 1].offset_m - stretches[i].offset_m).norm();
    for (std::size_t k = i + 2; k < stretches.size(); ++k) {
      smallest_m = std::min(smallest_m, (stretches[k].offset_m - stretches[k - 1].offset_m).norm());
      if ((stretches[k].offset_m - stretches[i].offset_m).norm() < kNear * smallest_m) return true;
    }
  }
  return false;
}

/// Whether it is known which of the errors are aside: by promises, as the receiver comes back, or by how long they
/// last.
bool tellsAside(const std::vector<Stretch>& stretches, const std::vector<Measurement>& said) {
  constexpr double kMostOfTheTime = 0.75;
  double longest_s = 0.0;
  double all_s = 0.0;
  for (const Stretch& stretch : stretches) {
    longest_s = std::max(longest_s, stretch.duration_s);
    all_s += stretch.duration_s;
  }
  return longest_s > kMostOfTheTime * all_s || !arePromisedAlike(stretches, said) || comesBack(stretches);
}

/// That whose error lies in the middle of all (geometric median), by how long they last.
const Stretch& middleOf(const std::vector<Stretch>& stretches) {
  const auto distances = [&](const Stretch& stretch) {
    double sum = 0.0;
    for (const Stretch& other : stretches) sum += other.duration_s * (other.offset_m - stretch.offset_m).norm();
    return sum;
  };
  return *std::min_element(stretches.begin(), stretches.end(),
                           [&](const Stretch& one, const Stretch& other) { return distances(one) < distances(other); });
}

/// The standard deviation of the lasting errors that half of the time of all but `middle` shows, per axis.
double deviationFrom(const Stretch& middle, const std::vector<Stretch>& stretches) {
  std::vector<std::pair<double, double>> away_m;  // with how long each lasts
  double all_s = 0.0;
  for (const Stretch& stretch : stretches) {
    if (&stretch == &middle) continue;
    away_m.emplace_back((stretch.offset_m - middle.offset_m).norm(), stretch.duration_s);
    all_s += stretch.duration_s;
  }
  std::sort(away_m.begin(), away_m.end());
  std::size_t half = 0;
  for (double until_s = away_m[0].second; until_s < 0.5 * all_s; until_s += away_m[half].second) ++half;
  return away_m[half].first / kMedianOfPlane;
}

/// A receiver that steps aside for a while is worse for that while: the shorter a stretch between two steps and the
/// farther off it came out, the less it says about where the path is. One that promises the same throughout is believed
/// as far as it comes back to the same error: an RTK receiver that declares nothing, or 30 m, has centimetres most of
/// the time. `path`: as it came out; empty at first.
void weighStretches(const std::vector<Measurement>& said, const std::vector<PathState>& path,
                    std::vector<Measurement>& measurements) {
  constexpr double kLeastWeight = 0.1;  // or else one stretch after the other could lose its say
  constexpr double kLeastAlike = 0.01;  // half of the time is near the middle, and keeps it
  const std::vector<Stretch> stretches = stretchesOf(said, path);
  const bool alike = !path.empty() && arePromisedAlike(stretches, said);
  const Stretch& middle = middleOf(stretches);
  const Eigen::Vector2d usual_m = alike ? middle.offset_m : Eigen::Vector2d::Zero();
  const double shown_m = alike ? deviationFrom(middle, stretches) : 0.0;
  double longest_s = 0.0;
  for (const Stretch& stretch : stretches) longest_s = std::max(longest_s, stretch.duration_s);
  for (const Stretch& stretch : stretches) {
    const Measurement& first = said[stretch.begin];
    double expected_m = first.offset_m;
    if (alike) expected_m = std::min(expected_m, std::max(first.white_m, shown_m));
    const double squared = (stretch.offset_m - usual_m).squaredNorm() / squareOf(expected_m);
    const double weight = std::max(alike ? kLeastAlike : kLeastWeight, studentWeight(squared));
    const double offset_m = expected_m * std::sqrt(longest_s / stretch.duration_s / weight);
    for (std::size_t i = stretch.begin; i < stretch.end; ++i) measurements[i].offset_m = offset_m;
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
  std::vector<Measurement> said = measurements;
  bool steps = endOfStretch(said, 0) < said.size();
  bool doubts = false;
  for (Measurement& measurement : measurements) {
    if (!measurement.doubtful) continue;
    doubts = true;
    measurement.white_m = kNoWeight * (measurement.white_m + measurement.offset_m);
  }
  if (steps) weighStretches(said, {}, measurements);
  std::vector<PathState> path = smooth(measurements, motion);
  if (steps && !tellsAside(stretchesOf(said, path), said)) {
    steps = false;
    for (std::size_t i = 0; i < said.size(); ++i) {
      said[i].steps = measurements[i].steps = false;
      measurements[i].offset_m = said[i].offset_m;
    }
    path = smooth(measurements, motion);
  }
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

#include "geo/lasting_errors.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "base/numbers.h"
#include "geo/motion_scales.h"

namespace visual_localization {
namespace {

std::size_t endOfStretch(const std::vector<Measurement>& measurements, std::size_t begin) {
  std::size_t end = begin + 1;
  while (end < measurements.size() && !measurements[end].steps) ++end;
  return end;
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

/// The stretches whose lasting error is near that in the middle of all.
std::vector<bool> nearMiddle(const std::vector<Stretch>& stretches) {
  constexpr double kNear = 0.25;  // of the usual step
  std::vector<double> steps_m;
  for (std::size_t i = 1; i < stretches.size(); ++i) {
    steps_m.push_back((stretches[i].offset_m - stretches[i - 1].offset_m).norm());
  }
  const double near_m = kNear * median(std::move(steps_m));
  const Stretch& middle = middleOf(stretches);
  std::vector<bool> near;
  for (const Stretch& stretch : stretches) near.push_back((stretch.offset_m - middle.offset_m).norm() <= near_m);
  return near;
}

/// Stretches [begin, end) that are not near the middle of all.
struct Excursion {
  std::size_t begin = 0;
  std::size_t end = 0;
  double duration_s = 0.0;
  bool returns = false;  ///< it comes from the middle and leads back to it
};

std::vector<Excursion> excursionsOf(const std::vector<Stretch>& stretches) {
  const std::vector<bool> near = nearMiddle(stretches);
  std::vector<Excursion> excursions;
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    if (near[i]) continue;
    if (i == 0 || near[i - 1]) excursions.push_back({i, i});
    excursions.back().end = i + 1;
    excursions.back().duration_s += stretches[i].duration_s;
    excursions.back().returns = excursions.back().begin > 0 && i + 1 < stretches.size();
  }
  return excursions;
}

}  // namespace

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

bool hasSteps(const std::vector<Measurement>& measurements) {
  return endOfStretch(measurements, 0) < measurements.size();
}

bool dropUntold(const std::vector<PathState>& path, std::vector<Measurement>& said) {
  constexpr double kMostOfTheTime = 0.75;
  constexpr double kHalf = 0.5;
  const std::vector<Stretch> stretches = stretchesOf(said, path);
  if (stretches.size() < 2 || !arePromisedAlike(stretches, said)) return false;
  const std::vector<Excursion> excursions = excursionsOf(stretches);
  double near_s = 0.0;
  for (const Stretch& stretch : stretches) near_s += stretch.duration_s;
  const double all_s = near_s;
  double longest_s = 0.0;  // of those that return
  for (const Excursion& excursion : excursions) {
    near_s -= excursion.duration_s;
    if (excursion.returns) longest_s = std::max(longest_s, excursion.duration_s);
  }
  if (longest_s == 0.0 && near_s > kMostOfTheTime * all_s) return false;
  const bool told = longest_s > 0.0 && near_s > kHalf * all_s;
  bool dropped = false;
  for (const Excursion& excursion : excursions) {
    if (told && (excursion.returns || excursion.duration_s <= longest_s)) continue;
    for (std::size_t i = std::max<std::size_t>(1, excursion.begin); i <= excursion.end && i < stretches.size(); ++i) {
      said[stretches[i].begin].steps = false;
      dropped = true;
    }
  }
  return dropped;
}

void weighStretches(const std::vector<Measurement>& said, const std::vector<PathState>& path,
                    std::vector<Measurement>& measurements) {
  constexpr double kLeastWeight = 0.1;  // or else one stretch after the other could lose its say
  constexpr double kLeastAlike = 0.01;  // half of the time is near the middle, and keeps it
  const std::vector<Stretch> stretches = stretchesOf(said, path);
  const bool promised_alike = arePromisedAlike(stretches, said);
  const bool alike = !path.empty() && promised_alike;
  const Stretch& middle = middleOf(stretches);
  const Eigen::Vector2d usual_m = alike ? middle.offset_m : Eigen::Vector2d::Zero();
  const double shown_m = alike ? deviationFrom(middle, stretches) : 0.0;
  double longest_s = 0.0;
  for (const Stretch& stretch : stretches) longest_s = std::max(longest_s, stretch.duration_s);
  for (const Stretch& stretch : stretches) {
    const Measurement& first = said[stretch.begin];
    double expected_m = first.offset_m;
    if (alike) expected_m = std::min(expected_m, std::max(first.white_m, shown_m));
    const double squared = (stretch.offset_m - usual_m).squaredNorm() / (expected_m * expected_m);
    const double weight = std::max(alike ? kLeastAlike : kLeastWeight, studentWeight(squared));
    const double shortness = promised_alike ? longest_s / stretch.duration_s : 1.0;
    const double offset_m = expected_m * std::sqrt(shortness / weight);
    for (std::size_t i = stretch.begin; i < stretch.end; ++i) measurements[i].offset_m = offset_m;
  }
}

}  // namespace visual_localization

#include "geo/altitudes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "base/numbers.h"

namespace visual_localization {
namespace {

constexpr double kSixSigma = 6.0 * 1.4826;  // by the median of absolute values

/// The indices of samples that have an altitude.
std::vector<std::size_t> measured(const std::vector<AltitudeSample>& samples, const std::vector<double>& up_m) {
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (std::isfinite(up_m[i])) indices.push_back(i);
  }
  return indices;
}

/// How far each altitude is from the median of those around it.
std::vector<double> awayFromMedian(const std::vector<std::size_t>& indices, const std::vector<double>& up_m) {
  constexpr std::size_t kWindow = 11;
  std::vector<double> away_m;
  const std::size_t window = std::min(kWindow, indices.size());
  for (std::size_t k = 0; k < indices.size(); ++k) {
    const std::size_t first = std::min(k - std::min(k, window / 2), indices.size() - window);
    std::vector<double> values;
    for (std::size_t j = first; j < first + window; ++j) values.push_back(up_m[indices[j]]);
    away_m.push_back(std::abs(up_m[indices[k]] - median(std::move(values))));
  }
  return away_m;
}

/// Height of the step between the k-th altitude and the next one, by a few on both sides.
double stepAt(std::size_t k, const std::vector<std::size_t>& indices, const std::vector<double>& up_m) {
  constexpr std::size_t kReach = 3;
  std::vector<double> steps_m;
  for (std::size_t j = 0; j < kReach && j <= k && k + 1 + j < indices.size(); ++j) {
    steps_m.push_back(up_m[indices[k + 1 + j]] - up_m[indices[k - j]]);
  }
  return median(std::move(steps_m));
}

}  // namespace

std::optional<double> plausibleAltitude(double altitude_m) {
  constexpr double kLowest_m = -1000.0;
  constexpr double kHighest_m = 10000.0;
  if (!(altitude_m >= kLowest_m && altitude_m <= kHighest_m)) return std::nullopt;
  return altitude_m;
}

std::vector<double> steadyAltitudes(const std::vector<AltitudeSample>& samples) {
  constexpr double kLeastOutlier_m = 2.0;
  constexpr double kLeastStep_m = 5.0;
  constexpr double kSteepest = 0.3;  // of a road
  std::vector<double> up_m;
  for (const AltitudeSample& sample : samples) up_m.push_back(sample.up_m);
  std::vector<std::size_t> indices = measured(samples, up_m);
  const std::vector<double> away_m = awayFromMedian(indices, up_m);
  const double unusual_m = kSixSigma * median(away_m);
  for (std::size_t k = 0; k < indices.size(); ++k) {
    if (away_m[k] > std::max(kLeastOutlier_m, unusual_m)) up_m[indices[k]] = std::numeric_limits<double>::quiet_NaN();
  }
  indices = measured(samples, up_m);
  std::vector<double> steady_m = up_m;
  double stepped_m = 0.0;
  for (std::size_t k = 0; k + 1 < indices.size(); ++k) {
    const std::size_t here = indices[k];
    const std::size_t next = indices[k + 1];
    const double way_m = (samples[next].position_m - samples[here].position_m).norm();
    const double most_m = std::max(kLeastStep_m, unusual_m) + kSteepest * way_m;
    if (std::abs(up_m[next] - up_m[here]) > most_m) stepped_m += stepAt(k, indices, up_m);
    steady_m[next] -= stepped_m;
  }
  return steady_m;
}

}  // namespace visual_localization

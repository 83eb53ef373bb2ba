#include "geo/speed_prior.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "base/numbers.h"

namespace visual_localization {
namespace {

constexpr std::size_t kFewest = 20;
constexpr double kNormal = 1.4826;    // standard deviation by the median of absolute values
constexpr double kQuartiles = 1.349;  // distance of the quartiles in standard deviations

/// Sorted.
std::vector<double> speedsOver(const std::vector<PathSample>& nodes, double lag_s) {
  constexpr double kNearly = 0.9;
  constexpr double kGap = 2.0;
  std::vector<double> speeds_mps;
  std::size_t end = 0;
  for (const PathSample& begin : nodes) {
    while (end < nodes.size() && nodes[end].time_s - begin.time_s < kNearly * lag_s) ++end;
    if (end == nodes.size()) break;
    const double span_s = nodes[end].time_s - begin.time_s;
    if (span_s > kGap * lag_s) continue;
    speeds_mps.push_back((nodes[end].position_m - begin.position_m).norm() / span_s);
  }
  std::sort(speeds_mps.begin(), speeds_mps.end());
  return speeds_mps;
}

double spreadAround(const std::vector<double>& values, double middle) {
  std::vector<double> away;
  for (const double value : values) away.push_back(std::abs(value - middle));
  return kNormal * upperMedian(away);
}

/// A kernel over a histogram; the kernel's standard deviation is `bins` of its bins.
std::vector<double> smoothed(const std::vector<double>& histogram, double bins) {
  const auto count = static_cast<std::ptrdiff_t>(histogram.size());
  const auto reach = static_cast<std::ptrdiff_t>(4.0 * bins);
  std::vector<double> density(histogram.size(), 0.0);
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    for (std::ptrdiff_t j = std::max<std::ptrdiff_t>(0, i - reach); j < std::min(count, i + reach + 1); ++j) {
      const double away = static_cast<double>(i - j) / bins;
      density[static_cast<std::size_t>(i)] += histogram[static_cast<std::size_t>(j)] * std::exp(-0.5 * away * away);
    }
  }
  return density;
}

}  // namespace

SpeedPrior::SpeedPrior(const std::vector<PathSample>& nodes, const MotionScales& scales, double tolerance,
                       bool varies) {
  constexpr double kStanding = 0.2;  // of the usual speed
  constexpr double kHardlyStops = 0.95;
  constexpr double kMostWhoStops = 4.0;     // slows down and sets off
  constexpr double kSlowest = 0.1;          // share of the speeds
  constexpr double kOfMiddle = 0.85;        // of a robot of constant speed at least, that of the slowest
  constexpr double kLeastTolerance = 0.05;  // the papers' robot in its bends
  standing_mps_ = kStanding * scales.usual_mps;
  std::vector<double> speeds_mps = speedsOver(nodes, kSpeedLag_s);
  const double all = static_cast<double>(speeds_mps.size());
  speeds_mps.erase(speeds_mps.begin(), std::upper_bound(speeds_mps.begin(), speeds_mps.end(), standing_mps_));
  if (speeds_mps.size() < kFewest) return;
  const double middle_mps = quantile(speeds_mps, 0.5);
  const double noise_mps = std::sqrt(2.0) * scales.noise_m / kSpeedLag_s;
  const bool stops = static_cast<double>(speeds_mps.size()) < kHardlyStops * all;
  most_for_slow_ = stops ? kMostWhoStops : std::numeric_limits<double>::infinity();
  if (tolerance > 0.0) {
    constant_mps_ = middle_mps;
    sigma_mps_ = std::hypot(noise_mps, tolerance * middle_mps);
  } else if (!varies && quantile(speeds_mps, kSlowest) > kOfMiddle * middle_mps) {
    constant_mps_ = middle_mps;
    sigma_mps_ = std::max(kLeastTolerance * middle_mps, spreadAround(speeds_mps, middle_mps));
  } else {
    learnDensity(speeds_mps, noise_mps);
  }
}

void SpeedPrior::learnDensity(const std::vector<double>& speeds_mps, double noise_mps) {
  constexpr std::size_t kBins = 400;
  constexpr double kUnusual = 0.1;  // share of the speeds that cost something
  constexpr double kMostForFast = 8.0;
  constexpr double kMostForSlow = 3.0;
  constexpr double kLeastDensity = 1e-12;
  constexpr double kSlowest_mps = 1e-3;
  bin_mps_ = (2.0 * quantile(speeds_mps, 0.95) + kSlowest_mps) / static_cast<double>(kBins);
  const auto binOf = [this](double speed_mps) {
    return static_cast<std::size_t>(std::min(speed_mps / bin_mps_, static_cast<double>(kBins)));
  };
  std::vector<double> histogram(kBins + 1, 0.0);
  for (const double speed_mps : speeds_mps) {
    if (binOf(speed_mps) < kBins) histogram[binOf(speed_mps)] += 1.0;
  }
  const double spread_mps = (quantile(speeds_mps, 0.75) - quantile(speeds_mps, 0.25)) / kQuartiles;
  const double silverman_mps = 0.9 * spread_mps * std::pow(static_cast<double>(speeds_mps.size()), -0.2);
  const std::vector<double> density =
      smoothed(histogram, std::max({noise_mps, silverman_mps, 2.0 * bin_mps_}) / bin_mps_);
  std::vector<double> usual;
  for (const double speed_mps : speeds_mps) usual.push_back(density[binOf(speed_mps)]);
  const double reference = nearestRank(usual, kUnusual);
  const std::size_t middle = binOf(quantile(speeds_mps, 0.5));
  for (std::size_t bin = 0; bin <= kBins; ++bin) {
    const double cost = std::log(reference / std::max(kLeastDensity, density[bin]));
    costs_.push_back(std::clamp(cost, 0.0, bin < middle ? kMostForSlow : kMostForFast));
  }
}

double SpeedPrior::cost(double speed_mps) const {
  constexpr double kStandingCost = 0.5;  // of a robot that drives at constant speed
  const bool stands = speed_mps < standing_mps_;
  if (isConstant()) {
    if (stands) return kStandingCost;
    const double sigmas = (speed_mps - constant_mps_) / sigma_mps_;
    return sigmas > 0.0 ? 0.5 * sigmas * sigmas : std::min(most_for_slow_, 0.5 * sigmas * sigmas);
  }
  if (stands || costs_.empty()) return 0.0;
  return costs_[static_cast<std::size_t>(std::min(speed_mps / bin_mps_, static_cast<double>(costs_.size() - 1)))];
}

}  // namespace visual_localization

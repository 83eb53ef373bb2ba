#include "geometry/fix_budget.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iomanip>
#include <limits>
#include <numeric>
#include <optional>
#include <sstream>

#include "base/numbers.h"
#include "base/time.h"

namespace visual_localization {
namespace {

constexpr double kBin_s = 1.0;  ///< white noise of faster fixes hides how the rest is correlated
constexpr double kNormal = 1.4826;
constexpr double kTail = 3.0;  ///< sigmas; what is beyond is an outlier, no slow error, and counts as this
constexpr double kLongest_s = 3600.0;
constexpr double kPriorWeight = 4.0;
/// Of a receiver that claims nothing, per axis: satellites promise 8 m horizontally for 95 % of the time (GPS Standard
/// Positioning Service Performance Standard, 2020), which is 2.45 sigmas.
constexpr double kUndeclared_m = 3.3;
/// What its fixes count for in an adjustment: enough to say where the path lies, too little to bend it.
constexpr double kUndeclaredWeight_m = 0.3;

/// The mean of some residuals.
struct Bin {
  std::int64_t number = 0;
  Eigen::Vector2d off = Eigen::Vector2d::Zero();
};

/// In sigmas of their fixes, about their median, without tails.
std::vector<Eigen::Vector2d> normalised(const std::vector<FixResidual>& residuals) {
  std::vector<Eigen::Vector2d> all;
  for (const FixResidual& residual : residuals) all.emplace_back(residual.off_m / residual.sigma_m);
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    std::vector<double> values;
    for (const Eigen::Vector2d& one : all) values.push_back(one[axis]);
    const double middle = median(values);
    for (double& value : values) value = std::abs(value - middle);
    const double tail = kTail * std::max(1.0, kNormal * median(values));
    double mean = 0.0;
    for (Eigen::Vector2d& one : all) {
      one[axis] = std::clamp(one[axis] - middle, -tail, tail);
      mean += one[axis] / static_cast<double>(all.size());
    }
    for (Eigen::Vector2d& one : all) one[axis] -= mean;
  }
  return all;
}

std::vector<Bin> binned(const std::vector<FixResidual>& residuals, const std::vector<Eigen::Vector2d>& off,
                        double width_s) {
  std::vector<Bin> bins;
  std::size_t count = 0;
  for (std::size_t i = 0; i < off.size(); ++i) {
    const auto number = static_cast<std::int64_t>((residuals[i].time_s - residuals.front().time_s) / width_s);
    if (bins.empty() || bins.back().number != number) {
      bins.push_back({number, Eigen::Vector2d::Zero()});
      count = 0;
    }
    ++count;
    bins.back().off += (off[i] - bins.back().off) / static_cast<double>(count);
  }
  return bins;
}

/// Mean product per axis of bins that are `lag` apart; nothing known is 0.
double covarianceAt(std::int64_t lag, const std::vector<Bin>& bins) {
  double sum = 0.0;
  std::size_t pairs = 0;
  auto later = bins.begin();
  for (const Bin& bin : bins) {
    while (later != bins.end() && later->number < bin.number + lag) ++later;
    if (later == bins.end()) break;
    if (later->number != bin.number + lag) continue;
    sum += bin.off.dot(later->off);
    ++pairs;
  }
  return pairs == 0 ? 0.0 : 0.5 * sum / static_cast<double>(pairs);
}

/// Sum of the autocovariance over all lags, as far as it says anything: to where the correlated part has fallen to 1/e.
double summedCovariance(const std::vector<Bin>& bins) {
  const double first = covarianceAt(1, bins);
  double sum = covarianceAt(0, bins) + 2.0 * std::max(0.0, first);
  for (std::int64_t lag = 2; 2 * lag < static_cast<std::int64_t>(bins.size()); ++lag) {
    const double here = covarianceAt(lag, bins);
    if (!(here > 0.0 && here >= std::exp(-1.0) * first)) break;
    sum += 2.0 * here;
  }
  return sum;
}

double usualStep_s(const std::vector<FixResidual>& residuals) {
  std::vector<double> steps_s;
  for (std::size_t i = 1; i < residuals.size(); ++i) steps_s.push_back(residuals[i].time_s - residuals[i - 1].time_s);
  return median(std::move(steps_s));
}

}  // namespace

FixBudget fixBudget(const std::vector<FixResidual>& residuals, double adjusted_m) {
  FixBudget budget;
  std::vector<double> sigmas_m;
  for (const FixResidual& residual : residuals) sigmas_m.push_back(residual.sigma_m);
  budget.declared_m = median(std::move(sigmas_m));
  budget.sigma_m = std::max(budget.declared_m, adjusted_m);
  if (residuals.size() < 2) return budget;
  const std::vector<Eigen::Vector2d> off = normalised(residuals);
  const double shown = std::accumulate(off.begin(), off.end(), 0.0, [&](double sum, const Eigen::Vector2d& one) {
    return sum + 0.5 * one.squaredNorm() / static_cast<double>(off.size());
  });
  const double width_s = std::max(kBin_s, usualStep_s(residuals));
  const std::vector<Bin> bins = binned(residuals, off, width_s);
  const double summed = summedCovariance(bins);
  budget.residual_m = budget.declared_m * std::sqrt(shown);
  budget.correlation_s = shown > 0.0 ? width_s * summed / shown : 0.0;
  budget.duration_s = width_s * static_cast<double>(bins.size());
  const double bent = std::max(0.0, covarianceAt(1, bins) - 1.0);
  const double share = std::max(0.0, 1.0 - shown) + summed / static_cast<double>(bins.size());
  budget.sigma_m =
      std::hypot(std::max(budget.declared_m * std::sqrt(share), adjusted_m), budget.declared_m * std::sqrt(bent));
  return budget;
}

double sigmaOfUndeclared_m(const GeometryConfig& config) {
  return config.fix_sigma_m > 0.0 ? config.fix_sigma_m : kUndeclaredWeight_m;
}

FixBudget fixBudget(const Trajectory& path, const std::vector<MapFix>& fixes, const GeometryConfig& config) {
  std::vector<FixResidual> residuals;
  for (const MapFix& fix : fixes) {
    const std::optional<TrajectoryPoint> then = path.at(fix.stamp_ns);
    if (!then || !fix.believed) continue;
    residuals.push_back({secondsBetween(fixes.front().stamp_ns, fix.stamp_ns), fix.position_m - then->position_m,
                         fix.sigma_m > 0.0 ? fix.sigma_m : sigmaOfUndeclared_m(config)});
  }
  return withoutClaims(fixBudget(residuals), fixes, config);
}

FixBudget withoutClaims(FixBudget budget, const std::vector<MapFix>& fixes, const GeometryConfig& config) {
  const auto without = std::count_if(fixes.begin(), fixes.end(), [](const MapFix& fix) { return fix.sigma_m <= 0.0; });
  budget.assumed = 2 * without > static_cast<std::ptrdiff_t>(fixes.size());
  if (budget.assumed && config.fix_sigma_m <= 0.0) {
    budget.declared_m = std::max(kUndeclared_m, budget.residual_m);
    budget.sigma_m = std::max(budget.declared_m, budget.sigma_m);
  }
  return budget;
}

namespace {

/// By what the receiver claims and the residuals show alone.
double sigmaByReceiver_m(const FixBudget& budget) {
  const double hidden = std::max(0.0, std::pow(budget.declared_m, 2) - std::pow(budget.residual_m, 2));
  const double mean = budget.duration_s > 0.0 ? budget.correlation_s / budget.duration_s : 1.0;
  return std::sqrt(hidden + std::pow(budget.residual_m, 2) * mean);
}

}  // namespace

std::string describe(const FixBudget& budget) {
  constexpr double kMore = 1.1;
  std::ostringstream text;
  text << std::fixed << std::setprecision(2) << budget.sigma_m << " m per axis (one sigma): fixes "
       << (budget.assumed ? "claim no sigma, by geometry/fix_sigma or else as usual receivers " : "claim ")
       << budget.declared_m << " m and are " << budget.residual_m << " m off the path (rms), alike for "
       << std::setprecision(0) << budget.correlation_s << " of " << budget.duration_s << " s";
  if (budget.sigma_m > kMore * sigmaByReceiver_m(budget)) text << "; the adjustment leaves more open than they do";
  return text.str();
}

std::string describe(const DoubtfulStretch& stretch) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(0) << stretch.from_m << " to " << stretch.to_m << " m ("
       << std::setprecision(1) << secondsBetween(0, stretch.from_ns) << " to " << secondsBetween(0, stretch.to_ns)
       << " s): " << stretch.sigma_m << " m off per axis (one sigma)";
  constexpr double kLeast_m = 0.05;  // less is written as 0.0
  const bool by_turns = stretch.off_turns_m >= kLeast_m;
  if (by_turns) text << "; by the turns of the images " << stretch.off_turns_m << " m";
  if (stretch.off_fixes_m >= kLeast_m)
    text << (by_turns ? ", " : "; ") << "by the fixes " << stretch.off_fixes_m << " m";
  return text.str();
}

double receiverCorrelation_s(const FixBudget& budget) {
  const double share = std::pow(budget.sigma_m / budget.declared_m, 2);
  // Of the variance of the mean, 2 (x - 1 + exp(-x)) / x^2 with x = duration / correlation, the inverse to a few per
  // cent.
  if (!(share < 1.0)) return kLongest_s;
  return std::min(kLongest_s, budget.duration_s * share / ((2.0 + share) * (1.0 - share)));
}

CommonBudget commonBudget(const std::vector<TiedBudget>& sessions) {
  CommonBudget common;
  std::vector<std::size_t> order(sessions.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return sessions[a].begin_s < sessions[b].begin_s; });
  common.receivers.resize(sessions.size());
  std::vector<double> weights;
  std::vector<Eigen::Vector2d> offsets_m;
  double alike_until_s = -std::numeric_limits<double>::infinity();
  for (const std::size_t k : order) {
    const TiedBudget& session = sessions[k];
    const double weight = 1.0 / (session.budget.sigma_m * session.budget.sigma_m);
    if (session.begin_s > alike_until_s) {
      weights.push_back(0.0);
      offsets_m.emplace_back(Eigen::Vector2d::Zero());
    }
    common.receivers[k] = weights.size() - 1;
    if (weight > weights.back()) {
      weights.back() = weight;
      offsets_m.back() = session.offset_m;
    }
    alike_until_s = std::max(alike_until_s, session.end_s + receiverCorrelation_s(session.budget));
  }
  if (weights.size() < 2) return common;
  Eigen::Vector2d mean_m = Eigen::Vector2d::Zero();
  const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
  for (std::size_t g = 0; g < weights.size(); ++g) mean_m += weights[g] / total * offsets_m[g];
  double squared = 0.0;
  for (std::size_t g = 0; g < weights.size(); ++g) squared += weights[g] * (offsets_m[g] - mean_m).squaredNorm();
  common.stretch = std::sqrt((kPriorWeight + squared) / (kPriorWeight + 2.0 * static_cast<double>(weights.size() - 1)));
  return common;
}

}  // namespace visual_localization

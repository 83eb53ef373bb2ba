#include "evaluation/metrics.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <stdexcept>
#include <string>

namespace visual_localization {

ErrorStatistics summarise(std::vector<double> errors_m) {
  ErrorStatistics statistics;
  if (errors_m.empty()) return statistics;
  constexpr double kNear = 5.0;
  const auto count = static_cast<double>(errors_m.size());
  std::sort(errors_m.begin(), errors_m.end());
  const std::size_t middle = errors_m.size() / 2;
  statistics.count = errors_m.size();
  statistics.mean_m = std::accumulate(errors_m.begin(), errors_m.end(), 0.0) / count;
  statistics.median_m = errors_m.size() % 2 == 1 ? errors_m[middle] : 0.5 * (errors_m[middle - 1] + errors_m[middle]);
  const auto near = std::lower_bound(errors_m.begin(), errors_m.end(), kNear) - errors_m.begin();
  statistics.within_5m = static_cast<double>(near) / count;
  return statistics;
}

double recallAtPrecision(std::vector<Decision> decisions, double precision) {
  if (!(precision >= 0.0 && precision <= 1.0)) {
    throw std::invalid_argument("precision " + std::to_string(precision) + " is not in [0, 1]");
  }
  const auto unsure = [](const Decision& decision) { return std::isnan(decision.confidence); };
  if (std::any_of(decisions.begin(), decisions.end(), unsure)) throw std::invalid_argument("a confidence is NaN");
  std::sort(decisions.begin(), decisions.end(),
            [](const Decision& a, const Decision& b) { return a.confidence > b.confidence; });
  const std::size_t all = decisions.size();
  std::size_t correct = 0;
  std::size_t recalled = 0;
  for (std::size_t accepted = 1; accepted <= all; ++accepted) {
    correct += decisions[accepted - 1].correct ? 1 : 0;
    const bool tied = accepted < all && decisions[accepted].confidence == decisions[accepted - 1].confidence;
    if (!tied && static_cast<double>(correct) / static_cast<double>(accepted) >= precision) recalled = correct;
  }
  return all == 0 ? 0.0 : static_cast<double>(recalled) / static_cast<double>(all);
}

}  // namespace visual_localization

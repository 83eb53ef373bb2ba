#include "visual_localization/evaluation/error_statistics.h"

#include <algorithm>
#include <numeric>

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

}  // namespace visual_localization

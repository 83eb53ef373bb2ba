#include "visual_localization/features/histogram_intersection.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace visual_localization {

double histogramIntersection(const GlobalFeatures::Histogram& query, const GlobalFeatures::Histogram& training) {
  // Sums in lanes, so that the compiler may add four at once.
  constexpr std::size_t kLanes = 4;
  std::array<float, kLanes> common{};
  std::array<float, kLanes> all{};
  for (std::size_t i = 0; i < query.size(); i += kLanes) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      common[lane] += std::min(query[i + lane], training[i + lane]);
      all[lane] += query[i + lane];
    }
  }
  const double total = std::accumulate(all.begin(), all.end(), 0.0);
  return total > 0.0 ? std::accumulate(common.begin(), common.end(), 0.0) / total : 0.0;
}

}  // namespace visual_localization

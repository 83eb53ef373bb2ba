#include "visual_localization/features/histogram_intersection.h"

#include <algorithm>
#include <numeric>

namespace visual_localization {

double histogramIntersection(const GlobalFeatures::Histogram& query, const GlobalFeatures::Histogram& training) {
  // Sums in lanes, so that the compiler may add several at once.
  constexpr std::size_t kLanes = 16;
  std::array<float, kLanes> common{};
  std::array<float, kLanes> all{};
  for (std::size_t i = 0; i < query.size(); i += kLanes) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      common[lane] += std::min(query[i + lane], training[i + lane]);
      all[lane] += query[i + lane];
    }
  }
  const float total = std::accumulate(all.begin(), all.end(), 0.0F);
  if (!(total > 0.0F)) return 0.0;
  return std::min(1.0, static_cast<double>(std::accumulate(common.begin(), common.end(), 0.0F) / total));
}

}  // namespace visual_localization

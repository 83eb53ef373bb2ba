#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "base/numbers.h"
#include "survey/map_survey.h"

namespace visual_localization {
namespace {

/// Of the position of an image, per horizontal axis; nothing when nobody knows.
std::optional<double> sigmaOf_m(const TrainingMap& map, std::size_t image) {
  if (const auto geometry = map.geometry(image))
    return std::sqrt(0.5 * geometry->covariance.topLeftCorner<2, 2>().trace());
  const auto& fixes = map.header().sessions[static_cast<std::size_t>(map.pose(image).session)].fixes;
  return fixes ? std::optional<double>(fixes->sigma_m) : std::nullopt;
}

}  // namespace

std::vector<ErrorStretch> expectedErrors(const TrainingMap& map, std::size_t most_images) {
  constexpr double kAlike = 2.0;
  const std::size_t stride = strideFor(map.size(), most_images);
  std::vector<ErrorStretch> stretches;
  double along_m = 0.0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const int session = map.pose(i).session;
    const bool begins = i == 0 || map.pose(i - 1).session != session;
    along_m = begins ? 0.0 : along_m + (map.position_m(i) - map.position_m(i - 1)).norm();
    const std::optional<double> sigma_m = begins || i % stride == 0 ? sigmaOf_m(map, i) : std::nullopt;
    if (!stretches.empty() && stretches.back().session == session) stretches.back().to_m = along_m;
    if (!sigma_m) continue;
    ErrorStretch* last = stretches.empty() || stretches.back().session != session ? nullptr : &stretches.back();
    if (last != nullptr && std::max(*sigma_m, last->most_m) <= kAlike * std::min(*sigma_m, last->least_m)) {
      last->least_m = std::min(last->least_m, *sigma_m);
      last->most_m = std::max(last->most_m, *sigma_m);
    } else {
      stretches.push_back({session, along_m, along_m, *sigma_m, *sigma_m});
    }
  }
  return stretches;
}

}  // namespace visual_localization

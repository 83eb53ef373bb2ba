#include "visual_localization/localization/path_interpolation.h"

#include <cmath>
#include <cstddef>
#include <optional>

namespace visual_localization {
namespace {

constexpr std::size_t kMostSteps = 10;
constexpr double kFarthest_m = 10.0;      ///< between neighbours on a path; beyond a gap another one begins
constexpr std::size_t kLeastMatches = 8;  ///< for a median of their ratios

/// The next image of the session, ahead or behind.
std::optional<std::size_t> neighbourOf(const TrainingMap& map, std::size_t image, bool ahead) {
  if (ahead ? image + 1 >= map.size() : image == 0) return std::nullopt;
  const std::size_t next = ahead ? image + 1 : image - 1;
  if (map.pose(next).session != map.pose(image).session) return std::nullopt;
  if ((map.position_m(next) - map.position_m(image)).norm() > kFarthest_m) return std::nullopt;
  return next;
}

/// Positive when the image was taken ahead of the training image.
std::optional<double> leadOf(const Score& score) {
  if (!score.recognised || score.matches < kLeastMatches || !(score.scale > 0.0)) return std::nullopt;
  return std::log(score.scale);
}

}  // namespace

Eigen::Vector2d interpolateOnPath(const TrainingMap& map, Scores& scores, std::size_t image) {
  std::optional<double> lead = leadOf(scores[image]);
  const bool ahead = lead.value_or(0.0) > 0.0;
  std::size_t nearest = image;
  for (std::size_t step = 0; lead && *lead != 0.0 && step < kMostSteps; ++step) {
    const auto next = neighbourOf(map, nearest, ahead);
    const auto next_lead = next ? leadOf(scores[*next]) : std::nullopt;
    if (!next_lead) break;
    if ((*next_lead > 0.0) != ahead) {
      const double share = *lead / (*lead - *next_lead);
      return map.position_m(nearest) + share * (map.position_m(*next) - map.position_m(nearest));
    }
    if (std::abs(*next_lead) >= std::abs(*lead)) break;
    nearest = *next;
    lead = next_lead;
  }
  return map.position_m(nearest);
}

}  // namespace visual_localization

#include "geometry/fix_positions.h"

#include <algorithm>

#include "base/statistics.h"
#include "base/time.h"

namespace visual_localization {
namespace {

constexpr std::int64_t kReach_ns = 500'000'000;
constexpr double kSmallestSigma_m = 0.02;  ///< a receiver that claims less is not believed
constexpr double kLargestSigma_m = 10.0;

/// Half the way from one stamp to another, at most kReach_ns.
std::int64_t reach(std::int64_t from_ns, std::int64_t to_ns) { return std::min(kReach_ns, (to_ns - from_ns) / 2); }

Eigen::Vector2d velocityAt_m_s(const std::vector<TrajectoryPoint>& path, std::size_t i) {
  const TrajectoryPoint& before = path[i == 0 ? 0 : i - 1];
  const TrajectoryPoint& after = path[std::min(i + 1, path.size() - 1)];
  const double elapsed_s = secondsBetween(before.stamp_ns, after.stamp_ns);
  if (!(elapsed_s > 0.0)) return Eigen::Vector2d::Zero();
  return (after.position_m - before.position_m) / elapsed_s;
}

}  // namespace

std::vector<PositionObservation> positionsAt(const std::vector<TrajectoryPoint>& images,
                                             const std::vector<MapFix>& fixes, double sigma_m) {
  const Trajectory path(images);
  std::vector<PositionObservation> positions;
  auto fix = fixes.begin();
  for (std::size_t i = 0; i < images.size(); ++i) {
    const std::int64_t stamp_ns = images[i].stamp_ns;
    const std::int64_t before_ns = i == 0 ? kReach_ns : reach(images[i - 1].stamp_ns, stamp_ns);
    const std::int64_t after_ns = i + 1 == images.size() ? kReach_ns : reach(stamp_ns, images[i + 1].stamp_ns);
    std::vector<double> east;
    std::vector<double> north;
    std::vector<double> sigmas_m;
    while (fix != fixes.end() && fix->stamp_ns < stamp_ns - before_ns) ++fix;
    for (; fix != fixes.end() && fix->stamp_ns < stamp_ns + after_ns; ++fix) {
      const std::optional<TrajectoryPoint> then = path.at(fix->stamp_ns);
      if (!then) continue;
      const Eigen::Vector2d moved = fix->position_m + images[i].position_m - then->position_m;
      east.push_back(moved.x());
      north.push_back(moved.y());
      sigmas_m.push_back(fix->sigma_m > 0.0 ? std::clamp(fix->sigma_m, kSmallestSigma_m, kLargestSigma_m) : sigma_m);
    }
    if (east.empty()) continue;
    positions.push_back(
        {static_cast<std::uint32_t>(i), {median(east), median(north)}, median(sigmas_m), velocityAt_m_s(images, i)});
  }
  return positions;
}

}  // namespace visual_localization

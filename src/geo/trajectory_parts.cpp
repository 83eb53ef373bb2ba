#include "geo/trajectory_parts.h"

#include <algorithm>
#include <cstdint>
#include <exception>
#include <optional>
#include <stdexcept>
#include <utility>

#include "base/time.h"

namespace visual_localization {
namespace {

/// Where a part begins, by indices of the fixes, and their number.
std::vector<std::size_t> bordersOf(const std::vector<Fix>& fixes, double longest_s) {
  std::vector<std::size_t> borders{0};
  std::optional<std::int64_t> latest_ns;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    if (!hasPosition(fixes[i])) continue;
    if (latest_ns && secondsBetween(*latest_ns, fixes[i].stamp_ns) > longest_s) borders.push_back(i);
    latest_ns = latest_ns ? std::max(*latest_ns, fixes[i].stamp_ns) : fixes[i].stamp_ns;
  }
  borders.push_back(fixes.size());
  return borders;
}

/// Of a part that is no path.
std::vector<FixVerdict> rejected(const std::vector<Fix>& fixes) {
  std::vector<FixVerdict> verdicts;
  for (const Fix& fix : fixes) verdicts.push_back(hasPosition(fix) ? FixVerdict::kSpike : FixVerdict::kNoFix);
  return verdicts;
}

}  // namespace

CleanedTrajectory cleanInParts(const std::vector<Fix>& fixes, const LocalFrame& frame,
                               const TrajectoryCleanerConfig& config) {
  const std::vector<std::size_t> borders = bordersOf(fixes, config.max_bridge_s);
  if (borders.size() == 2) return cleanTrajectory(fixes, frame, config);
  CleanedTrajectory whole;
  std::vector<TrajectoryPoint> points;
  std::exception_ptr refusal;
  for (std::size_t k = 0; k + 1 < borders.size(); ++k) {
    const std::vector<Fix> part(fixes.begin() + static_cast<std::ptrdiff_t>(borders[k]),
                                fixes.begin() + static_cast<std::ptrdiff_t>(borders[k + 1]));
    CleanedTrajectory cleaned;
    try {
      cleaned = cleanTrajectory(part, frame, config);
    } catch (const std::runtime_error&) {
      refusal = std::current_exception();
      cleaned.verdicts = rejected(part);
    }
    const auto& of_part = cleaned.trajectory.points();
    points.insert(points.end(), of_part.begin(), of_part.end());
    whole.verdicts.insert(whole.verdicts.end(), cleaned.verdicts.begin(), cleaned.verdicts.end());
    whole.gaps_closed += cleaned.gaps_closed;
    whole.longest_gap_s = std::max(whole.longest_gap_s, cleaned.longest_gap_s);
  }
  if (points.empty()) std::rethrow_exception(refusal);
  whole.trajectory = Trajectory(std::move(points), config.max_bridge_s);
  return whole;
}

}  // namespace visual_localization

#include "visual_localization/geo/trajectory_cleaner.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include "base/numbers.h"
#include "geo/fix_judge.h"
#include "geo/fix_nodes.h"
#include "geo/path_smoother.h"

namespace visual_localization {
namespace {

/// For a refusal: why so few are left.
std::string lossesOf(const std::vector<FixVerdict>& verdicts) {
  std::string losses;
  for (const FixVerdict verdict : {FixVerdict::kTooFast, FixVerdict::kDisordered}) {
    const auto count = std::count(verdicts.begin(), verdicts.end(), verdict);
    if (count == 0) continue;
    losses +=
        " (" + std::to_string(count) + " of " + std::to_string(verdicts.size()) + " are " + toString(verdict) + ")";
  }
  return losses;
}

/// The states of a path, and enough between them to go round bends by straight lines.
std::vector<PathState> filledIn(const std::vector<PathState>& path) {
  constexpr double kStep_s = 0.25;
  constexpr double kMostSteps = 100.0;  // a path between two fixes has no more details
  std::vector<PathState> filled{path.front()};
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double elapsed_s = path[i].time_s - path[i - 1].time_s;
    const auto steps = static_cast<int>(std::clamp(std::ceil(elapsed_s / kStep_s), 1.0, kMostSteps));
    for (int k = 1; k < steps; ++k) {
      filled.push_back(between(path[i - 1], path[i], path[i - 1].time_s + elapsed_s * k / steps));
    }
    filled.push_back(path[i]);
  }
  return filled;
}

/// Direction of travel at each state. Where the robot stands it keeps the heading it came with.
std::vector<double> headingsOf(const std::vector<PathState>& path, double usual_mps) {
  constexpr double kStanding = 0.1;  // of the usual speed
  constexpr double kClearly = 2.0;   // sigmas of the velocity
  constexpr double kDriving = 0.5;   // of the usual speed, however badly it is known
  std::vector<double> yaw_rad(path.size(), 0.0);
  bool known = false;
  for (std::size_t k = 0; k < path.size(); ++k) {
    const Eigen::Vector2d& velocity_mps = path[k].velocity_mps;
    const double unclear_mps = std::min(kClearly * std::sqrt(path[k].velocity_var), kDriving * usual_mps);
    if (velocity_mps.norm() > std::max(kStanding * usual_mps, unclear_mps)) {
      yaw_rad[k] = std::atan2(velocity_mps.y(), velocity_mps.x());
      if (!known) std::fill(yaw_rad.begin(), yaw_rad.begin() + static_cast<std::ptrdiff_t>(k), yaw_rad[k]);
      known = true;
    } else if (k > 0) {
      yaw_rad[k] = yaw_rad[k - 1];
    }
  }
  return yaw_rad;
}

void append(const std::vector<PathState>& path, double usual_mps, std::int64_t start_ns,
            std::vector<TrajectoryPoint>& points) {
  const std::vector<PathState> filled = filledIn(path);
  const std::vector<double> yaw_rad = headingsOf(filled, usual_mps);
  for (std::size_t k = 0; k < filled.size(); ++k) {
    const auto stamp_ns = start_ns + static_cast<std::int64_t>(std::llround(filled[k].time_s * 1e9));
    if (!points.empty() && stamp_ns <= points.back().stamp_ns) continue;
    points.push_back({stamp_ns, filled[k].position_m, yaw_rad[k]});
  }
}

void countGaps(const UsableFixes& usable, const std::vector<FixVerdict>& verdicts, double max_gap_s,
               CleanedTrajectory& cleaned) {
  constexpr double kMissedFixes = 5.0;
  const double least_s = kMissedFixes * typicalInterval(usable.samples);
  std::optional<double> last_s;
  for (std::size_t i = 0; i < verdicts.size(); ++i) {
    if (verdicts[i] != FixVerdict::kKept) continue;
    const double time_s = usable.samples[i].time_s;
    const double gap_s = time_s - last_s.value_or(time_s);
    last_s = time_s;
    if (gap_s <= least_s || gap_s > max_gap_s) continue;
    ++cleaned.gaps_closed;
    cleaned.longest_gap_s = std::max(cleaned.longest_gap_s, gap_s);
  }
}

}  // namespace

std::string toString(FixVerdict verdict) {
  switch (verdict) {
    case FixVerdict::kKept:
      return "kept";
    case FixVerdict::kNoFix:
      return "no fix";
    case FixVerdict::kDisordered:
      return "out of order";
    case FixVerdict::kTooFast:
      return "faster than 50 Hz";
    case FixVerdict::kRepeated:
      return "repeated";
    case FixVerdict::kSpike:
      return "spike";
    case FixVerdict::kMultipath:
      return "multipath";
  }
  return "unknown";
}

void TrajectoryCleanerConfig::declare(ParameterVisitor& visitor) {
  visitor.real({"trajectory/speed_tolerance", "1",
                "how much the speed of travel varies, as a share of it; 0: whether it is constant, and how well, is "
                "learnt from the fixes"},
               speed_tolerance, 0.0, 10.0);
  visitor.real({"trajectory/max_bridge", "s", "longer stretches without believable fix are left open"}, max_bridge_s,
               0.1, 3600.0);
}

CleanedTrajectory cleanTrajectory(const std::vector<Fix>& fixes, const LocalFrame& frame,
                                  const TrajectoryCleanerConfig& config) {
  CleanedTrajectory cleaned;
  cleaned.verdicts.assign(fixes.size(), FixVerdict::kKept);
  const UsableFixes usable = usableFixes(fixes, frame, cleaned.verdicts);
  if (usable.samples.size() < 2) {
    throw std::runtime_error("only " + std::to_string(usable.samples.size()) + " of " + std::to_string(fixes.size()) +
                             " fixes are valid, a path needs at least 2" + lossesOf(cleaned.verdicts));
  }
  const FixJudge judge(usable, config);
  for (std::size_t i = 0; i < usable.indices.size(); ++i) cleaned.verdicts[usable.indices[i]] = judge.verdicts()[i];
  std::vector<TrajectoryPoint> points;
  for (const std::vector<PathState>& path : judge.paths()) {
    append(path, judge.motion().usual_mps, fixes[usable.indices.front()].stamp_ns, points);
  }
  if (points.size() < 2) {
    throw std::runtime_error("the fixes contradict each other: no two of them make a path" +
                             lossesOf(cleaned.verdicts));
  }
  countGaps(usable, judge.verdicts(), config.max_bridge_s, cleaned);
  cleaned.trajectory = Trajectory(std::move(points), config.max_bridge_s);
  return cleaned;
}

}  // namespace visual_localization

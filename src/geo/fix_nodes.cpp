#include "geo/fix_nodes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/numbers.h"
#include "base/time.h"

namespace visual_localization {
namespace {

/// Whether the frame shows it: the far side of the earth would lie near the datum again.
bool isWithinReach(const GeodeticPoint& point, const GeodeticPoint& datum) {
  constexpr double kEarth_m = 6.371e6;
  const double latitude_rad = toRadians(point.latitude_deg);
  const double datum_rad = toRadians(datum.latitude_deg);
  const double cosine =
      std::sin(latitude_rad) * std::sin(datum_rad) +
      std::cos(latitude_rad) * std::cos(datum_rad) * std::cos(toRadians(point.longitude_deg - datum.longitude_deg));
  return cosine >= std::cos(kLargestCoordinate_m / kEarth_m);
}

/// Of some of the fixes the most whose stamps increase: a single stamp far ahead does not cost all that follow. Gives
/// the others their verdict.
std::vector<std::size_t> inOrder(const std::vector<Fix>& fixes, const std::vector<std::size_t>& indices,
                                 std::vector<FixVerdict>& verdicts) {
  constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  std::vector<std::size_t> ends;  // of the best sequence of each length, the fix with the earliest stamp
  std::vector<std::size_t> previous(fixes.size(), kNone);
  for (const std::size_t i : indices) {
    verdicts[i] = FixVerdict::kDisordered;
    const auto at = std::lower_bound(ends.begin(), ends.end(), i, [&](std::size_t a, std::size_t b) {
      return fixes[a].stamp_ns < fixes[b].stamp_ns;
    });
    if (at != ends.begin()) previous[i] = *(at - 1);
    if (at == ends.end()) {
      ends.push_back(i);
    } else if (fixes[i].stamp_ns < fixes[*at].stamp_ns) {
      *at = i;
    }
  }
  std::vector<std::size_t> ordered;
  for (std::size_t i = ends.empty() ? kNone : ends.back(); i != kNone; i = previous[i]) {
    verdicts[i] = FixVerdict::kKept;
    ordered.push_back(i);
  }
  std::reverse(ordered.begin(), ordered.end());
  return ordered;
}

}  // namespace

UsableFixes usableFixes(const std::vector<Fix>& fixes, const LocalFrame& frame, std::vector<FixVerdict>& verdicts) {
  std::vector<std::size_t> candidates;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    if (!hasPosition(fixes[i])) {
      verdicts[i] = FixVerdict::kNoFix;
    } else if (!isWithinReach(fixes[i].position, frame.datum())) {
      verdicts[i] = FixVerdict::kSpike;
    } else {
      candidates.push_back(i);
    }
  }
  UsableFixes usable;
  for (const std::size_t i : inOrder(fixes, candidates, verdicts)) {
    const std::int64_t start_ns = fixes[usable.indices.empty() ? i : usable.indices.front()].stamp_ns;
    const double time_s = secondsBetween(start_ns, fixes[i].stamp_ns);
    if (!usable.samples.empty() && time_s - usable.samples.back().time_s < kShortestInterval_s) {
      verdicts[i] = FixVerdict::kTooFast;
      continue;
    }
    usable.samples.push_back({time_s, frame.toEastNorth(fixes[i].position)});
    usable.indices.push_back(i);
    const double sigma_m = fixes[i].sigma_m;
    usable.sigmas_m.push_back(sigma_m > 0.0 && std::isfinite(sigma_m) ? sigma_m : 0.0);
  }
  return usable;
}

double typicalInterval(const std::vector<PathSample>& samples) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < samples.size(); ++i) intervals.push_back(samples[i].time_s - samples[i - 1].time_s);
  return median(std::move(intervals));
}

std::vector<Node> nodesOf(const UsableFixes& usable, double node_s) {
  std::vector<Node> nodes;
  double node_end_s = 0.0;
  for (std::size_t i = 0; i < usable.samples.size(); ++i) {
    if (nodes.empty() || usable.samples[i].time_s >= node_end_s) {
      nodes.emplace_back();
      node_end_s = usable.samples[i].time_s + node_s;
    }
    nodes.back().members.push_back(i);
  }
  for (Node& node : nodes) {
    node.sample = medianOf(usable.samples, node.members);
    std::vector<double> sigmas_m;
    for (const std::size_t i : node.members) sigmas_m.push_back(usable.sigmas_m[i]);
    node.sigma_m = median(std::move(sigmas_m));
  }
  return nodes;
}

PathSample medianOf(const std::vector<PathSample>& samples, const std::vector<std::size_t>& members) {
  std::vector<double> time;
  std::vector<double> east;
  std::vector<double> north;
  for (const std::size_t i : members) {
    time.push_back(samples[i].time_s);
    east.push_back(samples[i].position_m.x());
    north.push_back(samples[i].position_m.y());
  }
  return {median(std::move(time)), {median(std::move(east)), median(std::move(north))}};
}

}  // namespace visual_localization

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

bool isSamePlace(const Fix& a, const Fix& b) {
  return a.position.latitude_deg == b.position.latitude_deg && a.position.longitude_deg == b.position.longitude_deg;
}

/// Where each run of fixes with one position begins, to the last bit, and the end.
std::vector<std::size_t> runsOf(const std::vector<Fix>& fixes, const std::vector<std::size_t>& ordered) {
  std::vector<std::size_t> begins;
  for (std::size_t k = 0; k < ordered.size(); ++k) {
    if (k == 0 || !isSamePlace(fixes[ordered[k - 1]], fixes[ordered[k]])) begins.push_back(k);
  }
  begins.push_back(ordered.size());
  return begins;
}

/// How many messages a driver makes of a fix: more than one where its topic is faster than its receiver. Then nearly
/// all runs are alike, and both coordinates change between them; those of a coarse receiver change one by one.
std::size_t messagesOfAFix(const std::vector<Fix>& fixes, const std::vector<std::size_t>& ordered,
                           const std::vector<std::size_t>& begins) {
  constexpr std::size_t kLeastRuns = 10;
  constexpr double kAlike = 0.8;
  constexpr double kWaver = 0.25;  // of the length of a run, at least one message
  if (begins.size() < kLeastRuns + 3) return 1;
  std::vector<double> lengths;  // the first and the last may be cut
  double both_change = 0.0;
  for (std::size_t run = 1; run + 2 < begins.size(); ++run) {
    lengths.push_back(static_cast<double>(begins[run + 1] - begins[run]));
    const GeodeticPoint& before = fixes[ordered[begins[run] - 1]].position;
    const GeodeticPoint& here = fixes[ordered[begins[run]]].position;
    both_change += before.latitude_deg != here.latitude_deg && before.longitude_deg != here.longitude_deg ? 1.0 : 0.0;
  }
  const double usual = std::round(median(lengths));
  const auto alike = std::count_if(lengths.begin(), lengths.end(), [usual](double length) {
    return length > 1.0 && std::abs(length - usual) <= std::max(1.0, kWaver * usual);
  });
  const double least = kAlike * static_cast<double>(lengths.size());
  return usual > 1.0 && static_cast<double>(alike) >= least && both_change >= least ? static_cast<std::size_t>(usual)
                                                                                    : 1;
}

/// Without those that a driver only repeats: they are of the time before. A receiver that stands may say the same for
/// long, so one fix of as many messages as usual stays.
std::vector<std::size_t> withoutRepeated(const std::vector<Fix>& fixes, const std::vector<std::size_t>& ordered,
                                         std::vector<FixVerdict>& verdicts) {
  const std::vector<std::size_t> begins = runsOf(fixes, ordered);
  const std::size_t messages = messagesOfAFix(fixes, ordered, begins);
  std::vector<std::size_t> kept;
  for (std::size_t run = 0; run + 1 < begins.size(); ++run) {
    for (std::size_t k = begins[run]; k < begins[run + 1]; ++k) {
      const std::size_t place = k - begins[run];
      const bool is_fix = place % messages == 0 && (place == 0 || begins[run + 1] - k >= messages);
      if (is_fix) kept.push_back(ordered[k]);
      if (!is_fix) verdicts[ordered[k]] = FixVerdict::kRepeated;
    }
  }
  return kept;
}

/// What rounding of the coordinates leaves along one axis: a standard deviation. Next to nothing for exact ones.
double roundingOf(const std::vector<PathSample>& samples) {
  constexpr double kNothing_m = 0.01;   // the frame of a large map is not quite straight
  constexpr double kSmall = 0.1;        // of the changes
  constexpr double kLeastShare = 0.05;  // fewer changes are steps and turns
  constexpr double kFewest = 20.0;
  constexpr double kOfUniform = 1.0 / 12.0;
  double variance = 0.0;
  for (const int axis : {0, 1}) {
    std::vector<double> changes_m;  // of the way from fix to fix
    for (std::size_t i = 2; i < samples.size(); ++i) {
      const double change_m =
          samples[i].position_m[axis] - 2.0 * samples[i - 1].position_m[axis] + samples[i - 2].position_m[axis];
      if (std::abs(change_m) > kNothing_m) changes_m.push_back(std::abs(change_m));
    }
    const double least = std::max(kFewest, kLeastShare * static_cast<double>(samples.size()));
    if (static_cast<double>(changes_m.size()) < least) continue;
    variance += kOfUniform * std::pow(nearestRank(changes_m, kSmall), 2) / 2.0;
  }
  return std::sqrt(variance);
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
  for (const std::size_t i : withoutRepeated(fixes, inOrder(fixes, candidates, verdicts), verdicts)) {
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
  usable.rounding_m = roundingOf(usable.samples);
  return usable;
}

double typicalInterval(const std::vector<PathSample>& samples) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < samples.size(); ++i) intervals.push_back(samples[i].time_s - samples[i - 1].time_s);
  return median(std::move(intervals));
}

std::vector<Node> nodesOf(const UsableFixes& usable, double node_s, const std::vector<std::size_t>& steps) {
  std::vector<Node> nodes;
  double node_end_s = 0.0;
  auto step = steps.begin();
  for (std::size_t i = 0; i < usable.samples.size(); ++i) {
    const bool is_step = step != steps.end() && *step == i;
    if (nodes.empty() || is_step || usable.samples[i].time_s >= node_end_s) {
      nodes.emplace_back();
      nodes.back().is_behind_step = is_step;
      if (is_step) ++step;
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
  std::vector<double> times_s;
  std::vector<Eigen::Vector2d> positions_m;
  for (const std::size_t i : members) {
    times_s.push_back(samples[i].time_s);
    positions_m.push_back(samples[i].position_m);
  }
  return {median(std::move(times_s)), medianOf(positions_m)};
}

Eigen::Vector2d medianOf(const std::vector<Eigen::Vector2d>& vectors) {
  std::vector<double> east;
  std::vector<double> north;
  for (const Eigen::Vector2d& vector : vectors) {
    east.push_back(vector.x());
    north.push_back(vector.y());
  }
  return {median(std::move(east)), median(std::move(north))};
}

}  // namespace visual_localization

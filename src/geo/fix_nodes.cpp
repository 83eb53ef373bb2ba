#include "geo/fix_nodes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/numbers.h"
#include "base/time.h"
#include "geo/motion_scales.h"

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
  return usable;
}

double typicalInterval(const std::vector<PathSample>& samples) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < samples.size(); ++i) intervals.push_back(samples[i].time_s - samples[i - 1].time_s);
  return median(std::move(intervals));
}

namespace {

/// Fixes on either side of a step that tell it.
constexpr std::size_t kBeside = 4;

/// Of the fixes around the one at `i`, axis by axis the median.
Eigen::Vector2d velocityAround(const std::vector<PathSample>& samples, std::size_t i) {
  std::vector<double> east;
  std::vector<double> north;
  for (std::size_t k = i - kBeside + 1; k < i + kBeside; ++k) {
    const double elapsed_s = samples[k].time_s - samples[k - 1].time_s;
    east.push_back((samples[k].position_m - samples[k - 1].position_m).x() / elapsed_s);
    north.push_back((samples[k].position_m - samples[k - 1].position_m).y() / elapsed_s);
  }
  return {median(std::move(east)), median(std::move(north))};
}

/// By how far the fixes from the one at `i` on are aside of those before it, for a robot that keeps its velocity.
double asideAt(const std::vector<PathSample>& samples, std::size_t i) {
  const Eigen::Vector2d velocity_mps = velocityAround(samples, i);
  const auto middleFrom = [&](std::size_t begin) {
    std::vector<double> east;
    std::vector<double> north;
    for (std::size_t k = begin; k < begin + kBeside; ++k) {
      const double elapsed_s = samples[k].time_s - samples[i].time_s;
      east.push_back(samples[k].position_m.x() - elapsed_s * velocity_mps.x());
      north.push_back(samples[k].position_m.y() - elapsed_s * velocity_mps.y());
    }
    return Eigen::Vector2d(median(std::move(east)), median(std::move(north)));
  };
  return (middleFrom(i) - middleFrom(i - kBeside)).norm();
}

/// Medians see a step also from a fix or two beside it: the fix that is farthest from the one before.
std::size_t exactly(const std::vector<PathSample>& samples, std::size_t i) {
  const Eigen::Vector2d velocity_mps = velocityAround(samples, i);
  const auto jump_m = [&](std::size_t k) {
    const double elapsed_s = samples[k].time_s - samples[k - 1].time_s;
    return (samples[k].position_m - samples[k - 1].position_m - elapsed_s * velocity_mps).norm();
  };
  std::size_t best = i;
  for (std::size_t k = i - kBeside / 2; k <= i + kBeside / 2 && k < samples.size(); ++k) {
    if (jump_m(k) > jump_m(best)) best = k;
  }
  return best;
}

}  // namespace

std::vector<std::size_t> stepsIn(const UsableFixes& usable) {
  constexpr double kLongest_s = 1.0;  // of kBeside fixes: a robot turns and brakes in longer ones
  constexpr double kSigmas = 8.0;
  constexpr double kMost_mps2 = 10.0;  // of a robot
  constexpr std::size_t kAround = 50;
  const std::vector<PathSample>& samples = usable.samples;
  std::vector<double> aside_m(samples.size(), 0.0);
  for (std::size_t i = kBeside; i + kBeside <= samples.size(); ++i) {
    const bool is_fast = samples[i].time_s - samples[i - kBeside].time_s <= kLongest_s &&
                         samples[i + kBeside - 1].time_s - samples[i - 1].time_s <= kLongest_s;
    if (is_fast) aside_m[i] = asideAt(samples, i);
  }
  const auto around = [&](std::size_t i, std::size_t reach) {
    const auto begin = aside_m.begin() + static_cast<std::ptrdiff_t>(i - std::min(i, reach));
    return std::vector<double>(begin,
                               aside_m.begin() + static_cast<std::ptrdiff_t>(std::min(i + reach + 1, aside_m.size())));
  };
  std::vector<std::size_t> steps;
  const double usual_m = median(aside_m);
  for (std::size_t i = kBeside; i + kBeside <= samples.size(); ++i) {
    const double promised_m = usable.sigmas_m[i] > 0.0 ? usable.sigmas_m[i] : kUsualError_m;
    const double half_s = 0.25 * (samples[i + kBeside - 1].time_s - samples[i - kBeside].time_s);
    const double driven_m = 0.5 * kMost_mps2 * half_s * half_s;
    if (aside_m[i] <= std::max({promised_m, driven_m, kSigmas / kMedianOfPlane * usual_m})) continue;
    const std::vector<double> beside = around(i, kBeside);
    if (*std::max_element(beside.begin(), beside.end()) > aside_m[i]) continue;
    if (aside_m[i] <= kSigmas / kMedianOfPlane * median(around(i, kAround))) continue;
    const std::size_t step = exactly(samples, i);
    if (steps.empty() || step > steps.back()) steps.push_back(step);
  }
  return steps;
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

#include "visual_localization/geo/trajectory_cleaner.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "base/numbers.h"
#include "base/time.h"
#include "geo/path_smoother.h"

namespace visual_localization {
namespace {

constexpr double kLeastSpeed = 0.05;  // m/s: below this a robot stands
constexpr double kSpike = 3.0;        // lengths of a node

/// Fixes of one recording with their local positions; indices refer to the fixes as given.
struct UsableFixes {
  std::vector<PathSample> samples;
  std::vector<std::size_t> indices;
};

/// Fixes that lie close together on the path, summarised by their median.
struct Node {
  PathSample sample;
  std::vector<std::size_t> members;  ///< of UsableFixes
};

UsableFixes usableFixes(const std::vector<Fix>& fixes, const LocalFrame& frame, std::vector<FixVerdict>& verdicts) {
  UsableFixes usable;
  std::int64_t last_ns = 0;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    if (!hasPosition(fixes[i])) {
      verdicts[i] = FixVerdict::kNoFix;
    } else if (!usable.indices.empty() && fixes[i].stamp_ns <= last_ns) {
      verdicts[i] = FixVerdict::kDisordered;
    } else {
      last_ns = fixes[i].stamp_ns;
      const std::int64_t start_ns = fixes[usable.indices.empty() ? i : usable.indices.front()].stamp_ns;
      const double time_s = secondsBetween(start_ns, last_ns);
      if (!usable.samples.empty() && time_s - usable.samples.back().time_s < kShortestInterval_s) {
        verdicts[i] = FixVerdict::kTooFast;
        continue;
      }
      usable.samples.push_back({time_s, frame.toEastNorth(fixes[i].position)});
      usable.indices.push_back(i);
    }
  }
  return usable;
}

/// For a refusal: why so few are left.
std::string tooFastOf(const std::vector<FixVerdict>& verdicts) {
  const auto count = std::count(verdicts.begin(), verdicts.end(), FixVerdict::kTooFast);
  if (count == 0) return "";
  return " (" + std::to_string(count) + " of " + std::to_string(verdicts.size()) + " are faster than 50 Hz)";
}

double typicalInterval(const std::vector<PathSample>& samples) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < samples.size(); ++i) intervals.push_back(samples[i].time_s - samples[i - 1].time_s);
  return median(std::move(intervals));
}

PathSample medianSample(const std::vector<PathSample>& samples, const std::vector<std::size_t>& members) {
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

std::vector<Node> summarise(const std::vector<PathSample>& samples, double node_s) {
  std::vector<Node> nodes;
  double node_end_s = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (nodes.empty() || samples[i].time_s >= node_end_s) {
      nodes.emplace_back();
      node_end_s = samples[i].time_s + node_s;
    }
    nodes.back().members.push_back(i);
  }
  for (Node& node : nodes) node.sample = medianSample(samples, node.members);
  return nodes;
}

std::vector<PathSample> samplesOf(const std::vector<Node>& nodes) {
  std::vector<PathSample> samples;
  for (const Node& node : nodes) samples.push_back(node.sample);
  return samples;
}

/// Noise of a single fix along one axis, metres: by second differences, in which steady motion cancels. Errors that
/// drift slowly do not show.
double fixNoise_m(const std::vector<PathSample>& samples) {
  constexpr double kSecondDifferences = 2.449;  // their standard deviation is sqrt(6) times that of white noise
  constexpr double kNormal = 1.4826;            // standard deviation by the median of absolute values
  std::vector<double> sizes_m;
  for (std::size_t i = 1; i + 1 < samples.size(); ++i) {
    const double before_s = samples[i].time_s - samples[i - 1].time_s;
    const double after_s = samples[i + 1].time_s - samples[i].time_s;
    if (std::max(before_s, after_s) > 1.5 * std::min(before_s, after_s)) continue;  // a gap
    const Eigen::Vector2d bend_m = samples[i + 1].position_m - 2.0 * samples[i].position_m + samples[i - 1].position_m;
    sizes_m.insert(sizes_m.end(), {std::abs(bend_m.x()), std::abs(bend_m.y())});
  }
  return sizes_m.empty() ? 0.0 : kNormal / kSecondDifferences * median(std::move(sizes_m));
}

/// That of the way between two nodes, by the noise of the fixes that each is the median of.
double nodeNoise_m(const std::vector<Node>& nodes, double fix_noise_m) {
  constexpr double kOfMedian = 1.2533;  // standard deviation of a median over that of a mean
  std::vector<double> counts;
  for (const Node& node : nodes) counts.push_back(static_cast<double>(node.members.size()));
  const double count = median(std::move(counts));
  return std::sqrt(2.0) * (count > 2.0 ? kOfMedian : 1.0) * fix_noise_m / std::sqrt(count);
}

/// `rough_mps` stands in where the recording is too short to measure its speed over several nodes.
DrivingModel motionOf(const std::vector<Node>& nodes, double node_s, double rough_mps, double fix_noise_m,
                      const TrajectoryCleanerConfig& config) {
  constexpr double kLongSpan = 4.0;  // nodes
  const std::vector<PathSample> samples = samplesOf(nodes);
  DrivingModel motion;
  const double measured_mps = measureSpeed(samples, kLongSpan * node_s).median_mps;
  motion.speed_mps = measured_mps > 0.0 ? std::max(kLeastSpeed, measured_mps) : rough_mps;
  motion.speed_std_mps = config.speed_tolerance * motion.speed_mps;
  // Few steps say little about their own noise, and one that looks too small refuses good fixes.
  motion.step_noise_m = std::max(node_s * measureSpeed(samples, 0.5 * node_s).std_mps, nodeNoise_m(nodes, fix_noise_m));
  motion.opening_cost = config.opening_cost;
  motion.rejection_cost = config.rejection_cost;
  motion.max_bridge_s = config.max_bridge_s;
  return motion;
}

/// Where multipath begins and ends its fixes look like the path they leave and point the wrong way: a rejected stretch
/// of more than one node grows by `margin_s` at both ends.
void widenRejections(const std::vector<Node>& nodes, double margin_s, std::vector<bool>& believed) {
  const std::vector<bool> before = believed;
  for (std::size_t begin = 0; begin < nodes.size(); ++begin) {
    if (before[begin]) continue;
    std::size_t end = begin;
    while (end + 1 < nodes.size() && !before[end + 1]) ++end;
    const double from_s = nodes[begin].sample.time_s - margin_s;
    const double to_s = nodes[end].sample.time_s + margin_s;
    if (end > begin) {
      for (std::size_t n = begin; n-- > 0 && nodes[n].sample.time_s >= from_s;) believed[n] = false;
      for (std::size_t n = end + 1; n < nodes.size() && nodes[n].sample.time_s <= to_s; ++n) believed[n] = false;
    }
    begin = end;
  }
}

/// Spikes within believed nodes, and all fixes of nodes that are not believed.
void judgeNodes(const std::vector<Node>& nodes, const std::vector<bool>& believed, const UsableFixes& usable,
                double spike_m, std::vector<FixVerdict>& verdicts) {
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const bool alone = (n == 0 || believed[n - 1]) && (n + 1 == nodes.size() || believed[n + 1]);
    for (const std::size_t i : nodes[n].members) {
      const double distance_m = (usable.samples[i].position_m - nodes[n].sample.position_m).norm();
      FixVerdict& verdict = verdicts[usable.indices[i]];
      if (distance_m > spike_m) {
        verdict = FixVerdict::kSpike;
      } else if (!believed[n]) {
        verdict = alone && nodes[n].members.size() == 1 ? FixVerdict::kSpike : FixVerdict::kMultipath;
      }
    }
  }
}

std::vector<PathSample> keptSamples(const UsableFixes& usable, const std::vector<FixVerdict>& verdicts) {
  std::vector<PathSample> kept;
  for (std::size_t i = 0; i < usable.samples.size(); ++i) {
    if (verdicts[usable.indices[i]] == FixVerdict::kKept) kept.push_back(usable.samples[i]);
  }
  return kept;
}

/// Direction of travel at each point of the path. Where the robot stands it keeps the heading it came with.
std::vector<double> headingsOf(const SmoothedPath& path, double speed_mps) {
  constexpr double kStanding = 0.1;
  const std::size_t count = path.positions_m.size();
  const double least_m = kStanding * speed_mps * 2.0 * path.step_s;
  std::vector<double> yaw_rad(count, 0.0);
  bool known = false;
  for (std::size_t k = 0; k < count; ++k) {
    const Eigen::Vector2d travel = path.positions_m[std::min(k + 1, count - 1)] - path.positions_m[k == 0 ? 0 : k - 1];
    if (travel.norm() > least_m) {
      yaw_rad[k] = std::atan2(travel.y(), travel.x());
      if (!known) std::fill(yaw_rad.begin(), yaw_rad.begin() + static_cast<std::ptrdiff_t>(k), yaw_rad[k]);
      known = true;
    } else if (k > 0) {
      yaw_rad[k] = yaw_rad[k - 1];
    }
  }
  return yaw_rad;
}

void append(const SmoothedPath& path, double speed_mps, std::int64_t start_ns, std::vector<TrajectoryPoint>& points) {
  const std::vector<double> yaw_rad = headingsOf(path, speed_mps);
  for (std::size_t k = 0; k < path.positions_m.size(); ++k) {
    const double time_s = path.start_s + static_cast<double>(k) * path.step_s;
    const auto stamp_ns = start_ns + static_cast<std::int64_t>(std::llround(time_s * 1e9));
    if (!points.empty() && stamp_ns <= points.back().stamp_ns) continue;
    points.push_back({stamp_ns, path.positions_m[k], yaw_rad[k]});
  }
}

/// Stretches of samples without a gap that is too long to bridge.
std::vector<std::vector<PathSample>> split(const std::vector<PathSample>& samples, double max_gap_s) {
  std::vector<std::vector<PathSample>> parts;
  for (const PathSample& sample : samples) {
    if (parts.empty() || sample.time_s - parts.back().back().time_s > max_gap_s) parts.emplace_back();
    parts.back().push_back(sample);
  }
  return parts;
}

void countGaps(const std::vector<PathSample>& part, double interval_s, CleanedTrajectory& cleaned) {
  constexpr double kMissedFixes = 5.0;
  for (std::size_t i = 1; i < part.size(); ++i) {
    const double gap_s = part[i].time_s - part[i - 1].time_s;
    if (gap_s <= kMissedFixes * interval_s) continue;
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
    case FixVerdict::kSpike:
      return "spike";
    case FixVerdict::kMultipath:
      return "multipath";
  }
  return "unknown";
}

void TrajectoryCleanerConfig::declare(ParameterVisitor& visitor) {
  visitor.real({"trajectory/node_length", "m", "fixes are judged in groups over about this much of the path"},
               node_length_m, 0.1, 100.0);
  visitor.real({"trajectory/speed_tolerance", "1", "how much the speed of travel varies, as a share of it"},
               speed_tolerance, 0.001, 10.0);
  visitor.real({"trajectory/opening_cost", "1", "evidence in squared sigmas that a rejected stretch must bring"},
               opening_cost, 0.0, 1000.0);
  visitor.real({"trajectory/rejection_cost", "1", "and as much more for each group of fixes in it"}, rejection_cost,
               0.01, 1000.0);
  visitor.real({"trajectory/margin", "m", "a rejected stretch grows by this much of the path at both ends"}, margin_m,
               0.0, 100.0);
  visitor.real({"trajectory/smoothing_length", "m", "the cleaned path follows details longer than this"},
               smoothing_length_m, 0.01, 100.0);
  visitor.real(
      {"trajectory/speed_stiffness", "1", "how firmly the path keeps its speed, against how firmly its direction"},
      speed_stiffness, 0.0, 1000.0);
  visitor.real({"trajectory/outlier_distance", "m", "fixes farther from the path lose their influence on it"},
               outlier_distance_m, 0.01, 100.0);
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
                             " fixes are valid, a path needs at least 2" + tooFastOf(cleaned.verdicts));
  }

  const double interval_s = typicalInterval(usable.samples);
  const double rough_mps = std::max(kLeastSpeed, measureSpeed(usable.samples, 10.0 * interval_s).median_mps);
  const double node_s = std::max(0.9 * interval_s, config.node_length_m / rough_mps);
  const std::vector<Node> nodes = summarise(usable.samples, node_s);
  const DrivingModel motion = motionOf(nodes, node_s, rough_mps, fixNoise_m(usable.samples), config);
  std::vector<bool> believed = consistentSamples(samplesOf(nodes), motion);
  widenRejections(nodes, config.margin_m / motion.speed_mps, believed);
  judgeNodes(nodes, believed, usable, kSpike * std::max(config.node_length_m, motion.speed_mps * node_s),
             cleaned.verdicts);

  const std::vector<PathSample> kept = keptSamples(usable, cleaned.verdicts);
  std::vector<TrajectoryPoint> points;
  for (const auto& part : split(kept, config.max_bridge_s)) {
    if (part.size() < 2) continue;
    const PathSmootherConfig smoother{config.smoothing_length_m / motion.speed_mps, config.outlier_distance_m,
                                      motion.speed_mps, config.speed_stiffness};
    append(smoothPath(part, smoother), motion.speed_mps, fixes[usable.indices.front()].stamp_ns, points);
    countGaps(part, interval_s, cleaned);
  }
  if (points.size() < 2) {
    throw std::runtime_error("the fixes contradict each other: no two of them make a path" +
                             tooFastOf(cleaned.verdicts));
  }
  cleaned.trajectory = Trajectory(std::move(points), config.max_bridge_s);
  return cleaned;
}

}  // namespace visual_localization

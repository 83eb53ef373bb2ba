#include "geo/fix_judge.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>

#include "base/numbers.h"
#include "geo/receiver_steps.h"

namespace visual_localization {
namespace {

constexpr double kSpike = 4.3;  ///< sigmas: one in ten thousand in the plane

std::vector<PathSample> samplesOf(const std::vector<Node>& nodes) {
  std::vector<PathSample> samples;
  for (const Node& node : nodes) samples.push_back(node.sample);
  return samples;
}

/// A second, or one fix. What is a little less takes in as many fixes although their stamps waver.
double nodeLength_s(const std::vector<PathSample>& samples) {
  constexpr double kLeast_s = 1.0;
  constexpr double kWavering = 0.3;
  const double interval_s = typicalInterval(samples);
  return std::max(kLeast_s, interval_s) - kWavering * interval_s;
}

/// Of some samples, the one that is farthest from the one before; there must be two.
std::size_t largestJump(const std::vector<PathSample>& samples, const std::vector<std::size_t>& members) {
  std::size_t at = 1;
  double largest_m = -1.0;
  for (std::size_t k = 1; k < members.size(); ++k) {
    const double jump_m = (samples[members[k]].position_m - samples[members[k - 1]].position_m).norm();
    if (jump_m > largest_m) largest_m = jump_m, at = k;
  }
  return at;
}

/// Speed from one sample to another. The median over about kSpeedLag_s is not made faster by noise and steps, that of
/// the whole way not slower by an error that moves against the drive: the larger of the two. None: too short.
std::optional<double> speedBetween(const std::vector<PathSample>& samples, std::size_t first, std::size_t last) {
  const auto speed_mps = [&](std::size_t from, std::size_t to) {
    return (samples[to].position_m - samples[from].position_m).norm() / (samples[to].time_s - samples[from].time_s);
  };
  std::vector<double> speeds_mps;
  std::size_t to = first;
  for (std::size_t from = first; from < last; ++from) {
    while (to < last && samples[to].time_s - samples[from].time_s < kSpeedLag_s) ++to;
    if (samples[to].time_s - samples[from].time_s < kSpeedLag_s) break;
    speeds_mps.push_back(speed_mps(from, to));
  }
  if (speeds_mps.empty()) return std::nullopt;
  return std::max(speed_mps(first, last), median(std::move(speeds_mps)));
}

}  // namespace

FixJudge::FixJudge(const UsableFixes& usable, const TrajectoryCleanerConfig& config)
    : usable_(usable),
      config_(config),
      nodes_(nodesOf(usable, nodeLength_s(usable.samples), stepsIn(usable))),
      samples_(samplesOf(nodes_)),
      aside_(nodes_.size(), false),
      verdicts_(usable.samples.size(), FixVerdict::kKept) {
  select(0.0, {});
  std::vector<bool> believed;
  for (std::size_t n = 0; n < nodes_.size(); ++n) believed.push_back(!isLeftOut(n));
  // Believed nodes may hold few bends: learnt from them alone, the acceleration would make the next one improbable.
  constexpr double kLeastShare = 0.25;
  const double least_density = kLeastShare * scales_.acceleration_density;
  const double constant_mps = select(least_density, believed).constant_mps();
  const bool varies = config.speed_tolerance == 0.0 && isSlowerSomewhere(constant_mps);
  if (varies) select(least_density, believed, varies);
  constant_speed_ = constant_mps > 0.0 && !varies;
  splitAtSteps();
  findDoubts(constant_speed_);
  for (const Part& part : parts()) {
    const std::vector<PathState> path = smoothPath(measurementsOf(part, false), motion_);
    takeBack(part, path);
    judgeFixes(part, path);
    findAside(part, path);
  }
  judgeLeftOut();
}

/// Whether the robot drove more slowly where nodes are left out.
bool FixJudge::isSlowerSomewhere(double constant_mps) const {
  constexpr double kSlower = 0.8;
  std::size_t end = 0;
  for (std::size_t begin = 0; begin < nodes_.size(); begin = std::max(end, begin + 1)) {
    end = endOfStretch(begin);
    if (end == begin) continue;
    const std::size_t first = begin > 0 ? begin - 1 : begin;
    const std::size_t last = std::min(end, nodes_.size() - 1);
    if (speedBetween(samples_, first, last).value_or(constant_mps) < kSlower * constant_mps) return true;
  }
  return false;
}

SpeedPrior FixJudge::select(double least_density, const std::vector<bool>& believed, bool varies) {
  std::vector<bool> steps;
  for (const Node& node : nodes_) steps.push_back(node.is_behind_step);
  scales_ = learnScales(samples_, believed, least_density, steps, usable_.rounding_m);
  motion_ = {scales_.acceleration_density, scales_.usual_mps};
  const SpeedPrior speeds(samples_, scales_, config_.speed_tolerance, varies);
  chosen_ = selectNodes(samples_, scales_, speeds, config_.max_bridge_s, steps);
  return speeds;
}

/// A step lies within a node, or within the one before it: the fixes before it belong to that one, and those behind it
/// to the node that steps.
void FixJudge::splitAtSteps() {
  for (std::size_t n = 1; n < nodes_.size(); ++n) {
    if (chosen_[n] != NodeVerdict::kStep || nodes_[n].is_behind_step || isLeftOut(n - 1)) continue;
    std::vector<std::size_t>& before = nodes_[n - 1].members;
    std::vector<std::size_t>& behind = nodes_[n].members;
    std::vector<std::size_t> members = before;
    members.insert(members.end(), behind.begin(), behind.end());
    const auto step = members.begin() + static_cast<std::ptrdiff_t>(largestJump(usable_.samples, members));
    before.assign(members.begin(), step);
    behind.assign(step, members.end());
    samples_[n - 1] = medianOf(usable_.samples, before);
    samples_[n] = medianOf(usable_.samples, behind);
  }
}

/// Where multipath begins and ends its fixes look like the path they leave and point the wrong way. Speeds tell where
/// as closely as they are measured: what is nearer to a stretch that was left out does not shape the path.
void FixJudge::findDoubts(bool constant_speed) {
  doubted_.assign(nodes_.size(), false);
  if (!constant_speed) return;
  for (std::size_t begin = 0; begin < nodes_.size(); ++begin) {
    if (!isLeftOut(begin)) continue;
    const std::size_t end = endOfStretch(begin);
    const double from_s = samples_[begin].time_s - kSpeedLag_s;
    const double to_s = samples_[end - 1].time_s + kSpeedLag_s;
    if (end > begin + 1) {
      for (std::size_t n = begin; n-- > 0 && samples_[n].time_s >= from_s;) doubted_[n] = true;
      for (std::size_t n = end; n < nodes_.size() && samples_[n].time_s <= to_s; ++n) doubted_[n] = true;
    }
    begin = end - 1;
  }
}

std::vector<FixJudge::Part> FixJudge::parts() const {
  std::vector<Part> found;
  double last_s = 0.0;
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    if (isLeftOut(n)) continue;
    if (found.empty() || samples_[n].time_s - last_s > config_.max_bridge_s) found.push_back({n, n});
    found.back().end = n + 1;
    last_s = samples_[n].time_s;
  }
  return found;
}

/// The first node behind `node` that is not left out.
std::size_t FixJudge::endOfStretch(std::size_t node) const {
  while (node < nodes_.size() && isLeftOut(node)) ++node;
  return node;
}

/// What a receiver promises is its whole error; what is white of it shows.
double FixJudge::offsetOf(double sigma_m) const {
  constexpr double kOfNoise = 3.0;
  constexpr double kLeast_m = 1e-3;
  constexpr double kMost_m = 100.0;
  const double noise_m = scales_.noise_m;
  if (sigma_m == 0.0) return std::max(kUsualError_m, kOfNoise * noise_m);
  return std::clamp(std::sqrt(std::max(0.0, sigma_m * sigma_m - noise_m * noise_m)), kLeast_m, kMost_m);
}

void FixJudge::addNode(std::size_t node, std::vector<Measurement>& into) const {
  into.push_back({samples_[node], scales_.noise_m, offsetOf(nodes_[node].sigma_m)});
}

/// Together they say as much as their node.
void FixJudge::addFixes(std::size_t node, std::vector<Measurement>& into) const {
  std::vector<std::size_t> kept;
  for (const std::size_t i : nodes_[node].members) {
    if (verdicts_[i] == FixVerdict::kKept || (aside_[node] && verdicts_[i] == FixVerdict::kMultipath))
      kept.push_back(i);
  }
  const double white_m = scales_.noise_m * std::sqrt(static_cast<double>(kept.size()));
  for (const std::size_t i : kept) into.push_back({usable_.samples[i], white_m, offsetOf(usable_.sigmas_m[i])});
}

/// Nodes [begin, end), which are left out: their way from one to the next shapes the bridge, and bounds it.
void FixJudge::addStretch(std::size_t begin, std::size_t end, std::vector<Measurement>& into) const {
  if (constant_speed_ || into.empty()) return;  // a constant speed bounds it
  const double offset_m = into.back().offset_m;
  for (std::size_t n = begin; n < end; ++n) into.push_back({samples_[n], scales_.noise_m, offset_m, false, true});
}

std::vector<Measurement> FixJudge::measurementsOf(const Part& part, bool of_fixes) const {
  std::vector<Measurement> measurements;
  bool steps = false;  // since the last measurement, also in a node of which nothing is believed or used
  for (std::size_t n = part.begin; n < part.end; ++n) {
    steps = steps || chosen_[n] == NodeVerdict::kStep;
    if (isLeftOut(n)) {
      const std::size_t end = endOfStretch(n);
      addStretch(n, end, measurements);
      n = end - 1;
    } else if (!doubted_[n] || n == part.begin || n + 1 == part.end) {
      const std::size_t here = measurements.size();
      of_fixes ? addFixes(n, measurements) : addNode(n, measurements);
      if (measurements.size() == here) continue;
      measurements[here].steps = steps;
      steps = false;
    }
  }
  return measurements;
}

/// Stretches that agree with the path after all.
void FixJudge::takeBack(const Part& part, const std::vector<PathState>& path) {
  constexpr double kAgrees = 9.2;  // 99 % of what is normal in the plane
  if (constant_speed_) return;     // speeds spoke against them, not distances
  for (std::size_t begin = part.begin; begin < part.end; ++begin) {
    if (!isLeftOut(begin)) continue;
    const std::size_t end = endOfStretch(begin);
    bool agrees = true;
    for (std::size_t n = begin; n < end; ++n) {
      const Reading reading = readingAt(path, motion_, samples_[n]);
      const double variance = scales_.tolerance[n] * (reading.variance + scales_.noise_m * scales_.noise_m);
      agrees = agrees && (samples_[n].position_m - reading.position_m).squaredNorm() <= kAgrees * variance;
    }
    if (agrees)
      std::fill(chosen_.begin() + static_cast<std::ptrdiff_t>(begin),
                chosen_.begin() + static_cast<std::ptrdiff_t>(end), NodeVerdict::kBelieved);
    begin = end - 1;
  }
}

/// Spikes within believed nodes. A receiver's noise may have wide tails: a spike is beyond them.
void FixJudge::judgeFixes(const Part& part, const std::vector<PathState>& path) {
  constexpr double kTail = 0.8;  // of the fixes
  constexpr double kBeyondTail = 3.0;
  constexpr double kPromised = 3.0;  // sigmas by the receiver's own claim
  std::vector<std::size_t> fixes;
  std::vector<double> away_m;
  std::vector<double> variances;
  for (std::size_t n = part.begin; n < part.end; ++n) {
    if (isLeftOut(n)) continue;
    for (const std::size_t i : nodes_[n].members) {
      const Reading reading = readingAt(path, motion_, usable_.samples[i]);
      fixes.push_back(i);
      away_m.push_back((usable_.samples[i].position_m - reading.position_m).norm());
      variances.push_back(reading.variance);
    }
  }
  std::vector<double> sorted = away_m;
  const double tail_m = kBeyondTail * nearestRank(sorted, kTail);
  const double noise_m = std::max(scales_.noise_m, median(away_m) / kMedianOfPlane);
  for (std::size_t k = 0; k < fixes.size(); ++k) {
    const double sigma_m = std::sqrt(noise_m * noise_m + variances[k]);
    const double promised_m = std::min(kPromised * usable_.sigmas_m[fixes[k]], kSpike * offsetOf(0.0));
    if (away_m[k] > std::max({kSpike * sigma_m, tail_m, promised_m})) verdicts_[fixes[k]] = FixVerdict::kSpike;
  }
}

/// Nodes between two steps whose error is not the usual one and larger than their receiver promises, where it promises
/// the same throughout. Their relative positions shape the path all the same.
void FixJudge::findAside(const Part& part, const std::vector<PathState>& path) {
  constexpr double kPromise = 2.45;  // sigmas: 95 % in the plane
  std::vector<Eigen::Vector2d> offsets_m;
  double least_m = std::numeric_limits<double>::infinity();
  double most_m = 0.0;
  for (const PathState& state : path) offsets_m.push_back(state.offset_m);
  for (std::size_t n = part.begin; n < part.end; ++n) {
    least_m = std::min(least_m, offsetOf(nodes_[n].sigma_m));
    most_m = std::max(most_m, offsetOf(nodes_[n].sigma_m));
  }
  if (most_m > kOtherPromise * least_m) return;
  const Eigen::Vector2d usual_m = medianOf(offsets_m);
  auto state = path.begin();
  for (std::size_t n = part.begin; n < part.end; ++n) {
    while (state + 1 != path.end() && state->time_s < samples_[n].time_s) ++state;
    const double promised_m = (nodes_[n].sigma_m > 0.0 ? kPromise : 1.0) * offsetOf(nodes_[n].sigma_m);
    const double limit_m = std::max(promised_m, kSpike * scales_.noise_m);
    aside_[n] = !isLeftOut(n) && (state->offset_m - usual_m).norm() > limit_m;
  }
}

/// Also what a believed node has in excess beside a stretch that is left out belongs to it.
void FixJudge::judgeLeftOut() {
  for (std::size_t n = 0; n < nodes_.size(); ++n) {
    const bool alone = (n == 0 || !isLeftOut(n - 1)) && (n + 1 == nodes_.size() || !isLeftOut(n + 1));
    for (const std::size_t i : nodes_[n].members) {
      if (isLeftOut(n)) {
        verdicts_[i] = alone && nodes_[n].members.size() == 1 ? FixVerdict::kSpike : FixVerdict::kMultipath;
      } else if (aside_[n] || (doubted_[n] && verdicts_[i] == FixVerdict::kSpike)) {
        verdicts_[i] = FixVerdict::kMultipath;
      }
    }
  }
}

std::vector<std::vector<PathState>> FixJudge::paths() const {
  std::vector<std::vector<PathState>> paths;
  for (const Part& part : parts()) {
    std::vector<Measurement> measurements = measurementsOf(part, true);
    if (measurements.size() >= 2) paths.push_back(smoothPath(std::move(measurements), motion_));
  }
  return paths;
}

}  // namespace visual_localization

#include "geo/node_selection.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace visual_localization {
namespace {

constexpr std::size_t kNone = static_cast<std::size_t>(-1);

// What a path costs besides its innovations and speeds, in nats.
constexpr double kOpening = 10.0;   // a stretch that is left out
constexpr double kPerNode = 1.0;    // each node in it, more than what believing it usually costs
constexpr double kPerSecond = 1.0;  // and each second of it beyond kShort_s
constexpr double kShort_s = 20.0;
constexpr double kAtAnEnd = 8.0;     // more where the recording begins or ends
constexpr double kStep = 9.0;        // a step of the receiver's error that the fixes do not show
constexpr double kPerLogStep = 1.5;  // and by its size: large ones are rare
constexpr double kUsualStep_m = 1.5;
constexpr double kMostForUncertain = 12.0;  // a prediction over a long stretch says little

/// A path that ends at a node.
struct Survivor {
  ConstantVelocity state;
  double cost = 0.0;
  double rank = 0.0;  ///< cost, and how little is known of the state: that will cost later
  std::size_t previous = kNone;
  std::size_t which = 0;  ///< of the survivors of `previous`
  bool steps = false;
};

class Selection {
 public:
  Selection(const std::vector<PathSample>& nodes, const MotionScales& scales, const SpeedPrior& speeds,
            double max_bridge_s, const std::vector<bool>& steps)
      : nodes_(nodes),
        scales_(scales),
        speeds_(speeds),
        max_bridge_s_(max_bridge_s),
        steps_(steps),
        survivors_(nodes.size()) {
    for (const double mean_cost : scales.mean_cost) skipped_.push_back(skipped_.back() + mean_cost + kPerNode);
  }

  /// Of nodes [begin, end).
  void select(std::size_t begin, std::size_t end, std::vector<NodeVerdict>& verdicts) {
    for (std::size_t j = begin; j < end; ++j) {
      startAt(j, begin);
      for (std::size_t i = j; i-- > begin && nodes_[j].time_s - nodes_[i].time_s <= max_bridge_s_;) {
        for (std::size_t k = 0; k < survivors_[i].size(); ++k) extend(i, k, j);
      }
    }
    Survivor last = bestEnd(begin, end);
    while (last.previous != kNone) {
      const Survivor& survivor = survivors_[last.previous][last.which];
      verdicts[last.previous] = survivor.steps ? NodeVerdict::kStep : NodeVerdict::kBelieved;
      last = survivor;
    }
  }

 private:
  /// Of leaving out nodes [begin, end), which takes so long.
  double costOfSkipping(std::size_t begin, std::size_t end, double duration_s) const {
    if (begin == end) return 0.0;
    return kOpening + skipped_[end] - skipped_[begin] + kPerSecond * std::max(0.0, duration_s - kShort_s);
  }

  void startAt(std::size_t j, std::size_t begin) {
    Survivor first;
    first.state = ConstantVelocity::startAt(nodes_[j].position_m, scales_.noise_m, scales_.usual_mps);
    first.cost = scales_.mean_cost[j] + costOfSkipping(begin, j, nodes_[j].time_s - nodes_[begin].time_s);
    if (j > begin) first.cost += kAtAnEnd;
    add(first, j);
  }

  void extend(std::size_t i, std::size_t k, std::size_t j) {
    const double elapsed_s = nodes_[j].time_s - nodes_[i].time_s;
    Survivor next = survivors_[i][k];
    next.previous = i;
    next.which = k;
    next.steps = false;
    next.cost += costOfSkipping(i + 1, j, elapsed_s);
    next.state.predict(elapsed_s, scales_.acceleration_density);
    if (j == i + 1) addStep(next, j);
    const double noise_var = scales_.noise_m * scales_.noise_m;
    const double variance = next.state.position_var + noise_var;
    const Eigen::Vector2d innovation_m = nodes_[j].position_m - next.state.position_m;
    next.cost += studentCost(innovation_m.squaredNorm() / (variance * scales_.tolerance[j])) + speedCost(i, k, j);
    if (survivors_[i][k].previous != kNone) {  // nobody knows the velocity at the first node
      next.cost += std::clamp(std::log(variance) - scales_.log_variance, 0.0, kMostForUncertain);
    }
    next.state.update(nodes_[j].position_m, noise_var);
    add(next, j);
  }

  void addStep(Survivor next, std::size_t j) {
    const double steps = (nodes_[j].position_m - next.state.position_m).norm() / kUsualStep_m;
    next.cost += scales_.mean_cost[j] + kPerLogStep * std::log1p(steps * steps);
    if (steps_.empty() || !steps_[j]) next.cost += kStep;
    next.steps = true;
    next.state.stepTo(nodes_[j].position_m, scales_.noise_m * scales_.noise_m);
    add(next, j);
  }

  /// Of the way to `j` from the last node about kSpeedLag_s before it, for the share of it that is new.
  double speedCost(std::size_t i, std::size_t k, std::size_t j) const {
    constexpr double kNearly = 0.9;
    const double new_s = nodes_[j].time_s - nodes_[i].time_s;
    double elapsed_s = new_s;
    while (elapsed_s < kNearly * kSpeedLag_s) {
      const Survivor& survivor = survivors_[i][k];
      if (survivor.previous == kNone || survivor.steps) break;
      i = survivor.previous;
      k = survivor.which;
      elapsed_s = nodes_[j].time_s - nodes_[i].time_s;
    }
    const double speed_mps = (nodes_[j].position_m - nodes_[i].position_m).norm() / elapsed_s;
    return std::min(1.0, new_s / kSpeedLag_s) * speeds_.cost(speed_mps);
  }

  void add(Survivor survivor, std::size_t j) {
    constexpr std::size_t kMost = 3;
    survivor.rank = survivor.cost + survivor.state.logDeterminant();
    std::vector<Survivor>& best = survivors_[j];
    const auto at = std::upper_bound(best.begin(), best.end(), survivor,
                                     [](const Survivor& a, const Survivor& b) { return a.rank < b.rank; });
    if (at == best.end() && best.size() == kMost) return;
    best.insert(at, survivor);
    if (best.size() > kMost) best.pop_back();
  }

  /// Its `previous` is the last believed node.
  Survivor bestEnd(std::size_t begin, std::size_t end) const {
    Survivor best;
    best.cost = std::numeric_limits<double>::infinity();
    for (std::size_t j = begin; j < end; ++j) {
      for (std::size_t k = 0; k < survivors_[j].size(); ++k) {
        double cost = survivors_[j][k].cost + costOfSkipping(j + 1, end, nodes_[end - 1].time_s - nodes_[j].time_s);
        if (j + 1 < end) cost += kAtAnEnd;
        if (cost >= best.cost) continue;
        best.cost = cost;
        best.previous = j;
        best.which = k;
      }
    }
    return best;
  }

  const std::vector<PathSample>& nodes_;
  const MotionScales& scales_;
  const SpeedPrior& speeds_;
  double max_bridge_s_;
  const std::vector<bool>& steps_;
  std::vector<std::vector<Survivor>> survivors_;
  std::vector<double> skipped_{0.0};  ///< cost of leaving out all nodes before
};

}  // namespace

std::vector<NodeVerdict> selectNodes(const std::vector<PathSample>& nodes, const MotionScales& scales,
                                     const SpeedPrior& speeds, double max_bridge_s, const std::vector<bool>& steps) {
  std::vector<NodeVerdict> verdicts(nodes.size(), NodeVerdict::kLeftOut);
  Selection selection(nodes, scales, speeds, max_bridge_s, steps);
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= nodes.size(); ++i) {
    if (i < nodes.size() && nodes[i].time_s - nodes[i - 1].time_s <= max_bridge_s) continue;
    selection.select(begin, i, verdicts);
    begin = i;
  }
  return verdicts;
}

}  // namespace visual_localization

#pragma once

#include <vector>

#include "geo/fix_nodes.h"
#include "geo/motion_scales.h"
#include "geo/node_selection.h"
#include "geo/path_smoother.h"
#include "geo/speed_prior.h"

namespace visual_localization {

/// The path of a robot by the fixes of its receiver, in parts between gaps that are too long to bridge, and which of
/// the fixes are believed.
class FixJudge {
 public:
  FixJudge(const UsableFixes& usable, const TrajectoryCleanerConfig& config);

  /// Of the usable fixes.
  const std::vector<FixVerdict>& verdicts() const { return verdicts_; }
  /// Through the fixes that are believed.
  std::vector<std::vector<PathState>> paths() const;
  const Motion& motion() const { return motion_; }

 private:
  /// Believed nodes and what lies between them: [begin, end).
  struct Part {
    std::size_t begin = 0;
    std::size_t end = 0;
  };

  SpeedPrior select(double least_density, const std::vector<bool>& believed, bool varies = false);
  bool isSlowerSomewhere(double constant_mps) const;
  void splitAtSteps();
  void findDoubts(bool constant_speed);
  std::vector<Part> parts() const;
  bool isLeftOut(std::size_t node) const { return chosen_[node] == NodeVerdict::kLeftOut; }
  std::size_t endOfStretch(std::size_t node) const;
  double offsetOf(double sigma_m) const;
  void addNode(std::size_t node, std::vector<Measurement>& into) const;
  void addFixes(std::size_t node, std::vector<Measurement>& into) const;
  void addStretch(std::size_t begin, std::size_t end, std::vector<Measurement>& into) const;
  std::vector<Measurement> measurementsOf(const Part& part, bool of_fixes) const;
  void takeBack(const Part& part, const std::vector<PathState>& path);
  void judgeFixes(const Part& part, const std::vector<PathState>& path);
  void findAside(const Part& part, const std::vector<PathState>& path);
  void judgeLeftOut();

  const UsableFixes& usable_;
  const TrajectoryCleanerConfig& config_;
  std::vector<Node> nodes_;
  std::vector<PathSample> samples_;  ///< of the nodes
  MotionScales scales_;
  Motion motion_;
  std::vector<NodeVerdict> chosen_;
  bool constant_speed_ = false;
  std::vector<bool> doubted_;  ///< nodes that are believed but do not shape the path
  std::vector<bool> aside_;    ///< nodes whose position is wrong, but not the way between them
  std::vector<FixVerdict> verdicts_;
};

}  // namespace visual_localization

#pragma once

#include <cstddef>
#include <vector>

#include "geo/constant_velocity.h"
#include "visual_localization/geo/trajectory.h"
#include "visual_localization/geo/trajectory_cleaner.h"

namespace visual_localization {

/// Of receivers that promise nothing: along one axis, and lasting.
constexpr double kUsualError_m = 1.5;

/// Fixes of one recording with their local positions, in order of time.
struct UsableFixes {
  std::vector<PathSample> samples;   ///< time since the first of them
  std::vector<std::size_t> indices;  ///< of the fixes as given
  std::vector<double> sigmas_m;      ///< by the receiver's own claim; 0: none
  double rounding_m = 0.0;           ///< standard deviation along one axis by the rounding of the coordinates
};

/// Fixes that follow each other, summarised by their median.
struct Node {
  PathSample sample;
  double sigma_m = 0.0;              ///< by the receiver's own claim; 0: none
  std::vector<std::size_t> members;  ///< of UsableFixes
  bool is_behind_step = false;       ///< the fixes themselves show that the receiver's error has changed at once
};

/// Those that can be judged. Gives the others their verdict.
UsableFixes usableFixes(const std::vector<Fix>& fixes, const LocalFrame& frame, std::vector<FixVerdict>& verdicts);

/// Median of the times between fixes.
double typicalInterval(const std::vector<PathSample>& samples);

/// Nodes of about `node_s` seconds, none across one of `steps`.
std::vector<Node> nodesOf(const UsableFixes& usable, double node_s, const std::vector<std::size_t>& steps);

/// Median of some of the fixes, axis by axis.
PathSample medianOf(const std::vector<PathSample>& samples, const std::vector<std::size_t>& members);
Eigen::Vector2d medianOf(const std::vector<Eigen::Vector2d>& vectors);

}  // namespace visual_localization

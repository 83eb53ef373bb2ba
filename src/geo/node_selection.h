#pragma once

#include <vector>

#include "geo/constant_velocity.h"
#include "geo/motion_scales.h"
#include "geo/speed_prior.h"

namespace visual_localization {

/// What the most probable path makes of a node.
enum class NodeVerdict {
  kBelieved,
  kStep,  ///< believed, but the receiver's error has changed at once since the node before
  kLeftOut,
};

/// The most probable path through the nodes of a recording, which leaves out stretches that it can do without and steps
/// aside with the receiver's error (dynamic programming over the last believed node, with the best few filters for
/// each). A deviation by multipath costs its innovations and its speed, out and back, and so loses as a whole. Between
/// nodes more than `max_bridge_s` apart it begins anew. `steps`: nodes before which the fixes show a step, which
/// then costs its size alone; empty: none.
std::vector<NodeVerdict> selectNodes(const std::vector<PathSample>& nodes, const MotionScales& scales,
                                     const SpeedPrior& speeds, double max_bridge_s,
                                     const std::vector<bool>& steps = {});

}  // namespace visual_localization

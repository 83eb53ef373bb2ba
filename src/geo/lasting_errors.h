#pragma once

#include <vector>

#include "geo/path_smoother.h"

namespace visual_localization {

/// Makes a step where a receiver comes to promise much more or less: its error is another one. What it promises varies
/// a little all the time; between two steps it is the median.
void splitByPromises(std::vector<Measurement>& measurements);

bool hasSteps(const std::vector<Measurement>& measurements);

/// Drops the steps that nothing tells, of a receiver that promises alike throughout: all, unless it has one error for
/// most of the time or comes back to it; and those of an excursion that does not return and lasts longer than those
/// that do, since the step back may have been missed. `path`: as it came out. True if any was dropped.
bool dropUntold(const std::vector<PathState>& path, std::vector<Measurement>& said);

/// A receiver that steps aside for a while is worse for that while: the shorter a stretch between two steps and the
/// farther off it came out, the less it says about where the path is. One that promises the same throughout is believed
/// as far as it comes back to the same error: an RTK receiver that declares nothing, or 30 m, has centimetres most of
/// the time. `said`: as the receiver promises. `path`: as it came out; empty at first.
void weighStretches(const std::vector<Measurement>& said, const std::vector<PathState>& path,
                    std::vector<Measurement>& measurements);

}  // namespace visual_localization

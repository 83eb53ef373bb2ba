#pragma once

#include <vector>

namespace visual_localization {

/// How a robot was turned where it drove.
struct DrivenHeading {
  double beside_rad = 0.0;     ///< its heading, counter-clockwise from its direction of travel
  double curvature_1_m = 0.0;  ///< of its way, positive to the left
};

/// What all of its headings have in common.
struct HeadingOffset {
  double yaw_rad = 0.0;    ///< counter-clockwise from the direction of travel
  double sigma_rad = 0.0;  ///< of that, from one stretch of the drive to another
};

/// Least squares with Cauchy's loss, scaled by the median residual. In a bend a camera ahead of the axle swings aside
/// by its distance times the curvature: that distance is estimated along. Headings err alike for a while, so the sigma
/// is that of a jackknife over twelve stretches; infinite for fewer than 36 headings. `driven`: in order of time.
HeadingOffset headingOffset(const std::vector<DrivenHeading>& driven);

}  // namespace visual_localization

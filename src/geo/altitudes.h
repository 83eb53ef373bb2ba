#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

namespace visual_localization {

/// None where a robot on the ground cannot be: receivers without a third dimension, wrong units, single errors.
std::optional<double> plausibleAltitude(double altitude_m);

/// An altitude and where it was measured.
struct AltitudeSample {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  double up_m = 0.0;  ///< NaN: none
};

/// Of samples in order of time, altitudes that belong together: NaN for outliers, and without the steps of a receiver
/// that comes to measure from the sea instead of the ellipsoid. What is behind a step is moved to what is before.
std::vector<double> steadyAltitudes(const std::vector<AltitudeSample>& samples);

}  // namespace visual_localization

#pragma once

#include <vector>

#include <Eigen/Core>

#include "base/statistics.h"

namespace visual_localization {

/// The median of each component; zero of none.
inline Eigen::Vector3d medianOf(const std::vector<Eigen::Vector3d>& vectors) {
  Eigen::Vector3d middle;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> components;
    for (const Eigen::Vector3d& vector : vectors) components.push_back(vector[axis]);
    middle[axis] = median(components);
  }
  return middle;
}

}  // namespace visual_localization

#include "geometry/heading_offset.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include <Eigen/Core>
#include <Eigen/Dense>

#include "base/numbers.h"

namespace visual_localization {
namespace {

constexpr std::size_t kStretches = 12;
constexpr std::size_t kLeast = 3 * kStretches;
constexpr double kLeastScatter_rad = 1e-5;

double offsetOf(const std::vector<DrivenHeading>& driven) {
  constexpr int kSteps = 20;
  constexpr double kNormal = 1.4826;
  constexpr double kLoss = 2.0;      // sigmas
  constexpr double kDamping = 1e-9;  // where all is straight, no distance is told
  Eigen::Vector2d solution = Eigen::Vector2d::Zero();
  std::vector<double> residuals(driven.size());
  for (int step = 0; step < kSteps; ++step) {
    std::transform(driven.begin(), driven.end(), residuals.begin(), [&](const DrivenHeading& heading) {
      return std::abs(heading.beside_rad - solution.dot(Eigen::Vector2d(1.0, heading.curvature_1_m)));
    });
    const double scale = kLoss * std::max(kNormal * median(residuals), kLeastScatter_rad);
    Eigen::Matrix2d normal = kDamping * Eigen::Matrix2d::Identity();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (std::size_t i = 0; i < driven.size(); ++i) {
      const Eigen::Vector2d row(1.0, driven[i].curvature_1_m);
      const double in_scale = residuals[i] / scale;
      const double weight = 1.0 / (1.0 + in_scale * in_scale);
      normal += weight * row * row.transpose();
      right += weight * driven[i].beside_rad * row;
    }
    solution = normal.ldlt().solve(right);
  }
  return solution[0];
}

/// All but the k-th of the stretches.
std::vector<DrivenHeading> without(std::size_t k, std::vector<DrivenHeading> driven) {
  const auto at = [&](std::size_t stretch) {
    return driven.begin() + static_cast<std::ptrdiff_t>(stretch * driven.size() / kStretches);
  };
  driven.erase(at(k), at(k + 1));
  return driven;
}

}  // namespace

HeadingOffset headingOffset(const std::vector<DrivenHeading>& driven) {
  if (driven.size() < kLeast) return {0.0, std::numeric_limits<double>::infinity()};
  Eigen::Array<double, kStretches, 1> offsets_rad;
  for (std::size_t k = 0; k < kStretches; ++k) {
    offsets_rad[static_cast<Eigen::Index>(k)] = offsetOf(without(k, driven));
  }
  const double share = (kStretches - 1.0) / kStretches;
  return {offsetOf(driven), std::sqrt(share * (offsets_rad - offsets_rad.mean()).square().sum())};
}

}  // namespace visual_localization

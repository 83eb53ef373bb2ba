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

/// The offset of the headings outside [begin, end).
double offsetWithout(const std::vector<DrivenHeading>& driven, std::size_t begin, std::size_t end) {
  constexpr int kSteps = 20;
  constexpr double kNormal = 1.4826;
  constexpr double kLoss = 2.0;      // sigmas
  constexpr double kDamping = 1e-9;  // where all is straight, no distance is told
  Eigen::Vector2d solution = Eigen::Vector2d::Zero();
  for (int step = 0; step < kSteps; ++step) {
    std::vector<double> residuals;
    for (std::size_t i = 0; i < driven.size(); ++i) {
      if (i >= begin && i < end) continue;
      residuals.push_back(std::abs(driven[i].beside_rad - solution.dot(Eigen::Vector2d(1.0, driven[i].curvature_1_m))));
    }
    const double scale = kLoss * std::max(kNormal * median(residuals), kLeastScatter_rad);
    Eigen::Matrix2d normal = kDamping * Eigen::Matrix2d::Identity();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    std::size_t next = 0;
    for (std::size_t i = 0; i < driven.size(); ++i) {
      if (i >= begin && i < end) continue;
      const Eigen::Vector2d row(1.0, driven[i].curvature_1_m);
      const double in_scale = residuals[next++] / scale;
      const double weight = 1.0 / (1.0 + in_scale * in_scale);
      normal += weight * row * row.transpose();
      right += weight * driven[i].beside_rad * row;
    }
    solution = normal.ldlt().solve(right);
  }
  return solution[0];
}

}  // namespace

HeadingOffset headingOffset(const std::vector<DrivenHeading>& driven) {
  if (driven.size() < kLeast) return {0.0, std::numeric_limits<double>::infinity()};
  Eigen::Array<double, kStretches, 1> without;
  for (std::size_t k = 0; k < kStretches; ++k) {
    without[static_cast<Eigen::Index>(k)] =
        offsetWithout(driven, k * driven.size() / kStretches, (k + 1) * driven.size() / kStretches);
  }
  const double share = (kStretches - 1.0) / kStretches;
  return {offsetWithout(driven, 0, 0), std::sqrt(share * (without - without.mean()).square().sum())};
}

}  // namespace visual_localization

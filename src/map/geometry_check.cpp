#include "map/geometry_check.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include <Eigen/Cholesky>

#include "visual_localization/geo/local_frame.h"

namespace visual_localization {
namespace {

using Covariance = Eigen::Matrix<double, 6, 6>;

/// Of a correlation, for what rounding to floats and the adjustment itself may do to it.
constexpr double kCorrelationTolerance = 1e-5;
constexpr double kUnitTolerance = 1e-6;

// All comparisons are such that one with NaN refuses.

void requirePose(const CameraPose& camera) {
  if (!(camera.position_m.cwiseAbs().maxCoeff() <= kLargestCoordinate_m) || !camera.position_m.allFinite()) {
    throw std::runtime_error("the camera's position is not finite or too far from the datum");
  }
  if (!(std::abs(camera.rotation.norm() - 1.0) <= kUnitTolerance)) {
    throw std::runtime_error("the camera's rotation is not of unit length");
  }
}

/// Correlations; false when there is a covariance without the variances for it.
bool toCorrelations(Covariance& covariance) {
  const Eigen::Matrix<double, 6, 1> sigmas = covariance.diagonal().cwiseSqrt();
  for (Eigen::Index row = 0; row < 6; ++row) {
    for (Eigen::Index column = 0; column < 6; ++column) {
      const double most = sigmas[row] * sigmas[column];
      double& value = covariance(row, column);
      if (!(std::abs(value) <= (1.0 + kCorrelationTolerance) * most)) return false;
      value = most > 0.0 ? value / most : 0.0;
    }
  }
  return true;
}

/// Symmetric and positive semi-definite, whatever the units of its rows.
bool isCovariance(Covariance covariance) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  if (!covariance.allFinite() || covariance.cwiseAbs().maxCoeff() > kLargest) return false;
  if (covariance.diagonal().minCoeff() < 0.0 || !toCorrelations(covariance)) return false;
  if ((covariance - covariance.transpose()).cwiseAbs().maxCoeff() > kCorrelationTolerance) return false;
  covariance.diagonal().array() += kCorrelationTolerance;
  return covariance.llt().info() == Eigen::Success;
}

void requireLandmark(const SeenLandmark& landmark) {
  if (!(landmark.offset_m.cast<double>().norm() <= kLongestOffset_m)) {
    throw std::runtime_error("a landmark's offset is not finite or too long");
  }
  for (const float sigma_m : {landmark.sigma_along_m, landmark.sigma_across_m}) {
    if (!(sigma_m >= 0.0F && std::isfinite(sigma_m))) {
      throw std::runtime_error("a landmark's standard deviation is not finite or negative");
    }
  }
}

}  // namespace

void requireUsable(const ImageGeometry& geometry, std::size_t feature_count) {
  requirePose(geometry.camera);
  if (!isCovariance(geometry.covariance)) {
    throw std::runtime_error("the covariance of the camera's pose is not symmetric and positive semi-definite");
  }
  std::size_t lowest = 0;
  for (const SeenLandmark& landmark : geometry.landmarks) {
    if (landmark.feature >= feature_count) {
      throw std::runtime_error("a landmark belongs to feature " + std::to_string(landmark.feature) + " of " +
                               std::to_string(feature_count));
    }
    if (landmark.feature < lowest) throw std::runtime_error("the landmarks are not in order of their features");
    lowest = std::size_t{landmark.feature} + 1;
    requireLandmark(landmark);
  }
}

}  // namespace visual_localization

#include "geometry/landmark_covariance.h"

#include <cmath>

#include <Eigen/Cholesky>

namespace visual_localization {

Eigen::Matrix3d covarianceOf(const Landmark& landmark, const std::vector<CameraPose>& cameras) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (const LandmarkSighting& sighting : landmark.sightings) {
    const CameraPose& camera = cameras[sighting.image];
    const Eigen::Vector3d point = camera.toCamera(landmark.position_m);
    Eigen::Matrix<double, 2, 3> by_point;
    by_point << 1.0, 0.0, -point.x() / point.z(), 0.0, 1.0, -point.y() / point.z();
    by_point *= 1.0 / (point.z() * sighting.sigma);
    const Eigen::Matrix<double, 2, 3> by_landmark = by_point * camera.rotation.conjugate().toRotationMatrix();
    information += by_landmark.transpose() * by_landmark;
  }
  return information.ldlt().solve(Eigen::Matrix3d::Identity());
}

void addSighting(const Landmark& landmark, const Eigen::Matrix3d& covariance, std::uint32_t feature, std::uint32_t id,
                 ImageGeometry& image) {
  const Eigen::Vector3d offset = landmark.position_m - image.camera.position_m;
  const Eigen::Vector3d ray = offset.normalized();
  const double along_m2 = ray.dot(covariance * ray);
  const double across_m2 = 0.5 * (covariance.trace() - along_m2);
  if (!(std::isfinite(along_m2) && along_m2 > 0.0 && across_m2 > 0.0)) return;
  image.landmarks.push_back({feature, id, offset.cast<float>(), static_cast<float>(std::sqrt(along_m2)),
                             static_cast<float>(std::sqrt(across_m2))});
}

}  // namespace visual_localization

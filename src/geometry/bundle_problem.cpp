#include "geometry/bundle_problem.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include <Eigen/Cholesky>

#include "geometry/rays.h"

namespace visual_localization {

const BundleSession& BundleProblem::sessionOf(std::size_t camera) const {
  const auto after =
      std::upper_bound(sessions.begin(), sessions.end(), camera,
                       [](std::size_t image, const BundleSession& session) { return image < session.begin; });
  return *std::prev(after);
}

LensProjection BundleProblem::lensOf(std::size_t camera) const {
  const BundleLens& lens = lenses[sessionOf(camera).lens];
  return {lens.published, lens.correction};
}

std::optional<Eigen::Vector3d> wayAt(const BundleProblem& problem, std::size_t camera) {
  constexpr double kShortest_m = 0.2;
  constexpr double kLongest_m = 20.0;
  const Eigen::Vector3d way_m = problem.cameras[camera + 1].position_m - problem.cameras[camera - 1].position_m;
  if (way_m.norm() < kShortest_m || way_m.norm() > kLongest_m) return std::nullopt;
  return way_m;
}

double reprojectionError_px(const BundleProblem& problem, const Landmark& landmark,
                            const LandmarkObservation& observation) {
  const Eigen::Vector3d point = problem.cameras[observation.image].toCamera(landmark.position_m);
  if (!(point.z() >= kNearest_m)) return std::numeric_limits<double>::infinity();
  return (problem.lensOf(observation.image).project(point.hnormalized()) - observation.pixel).norm();
}

Eigen::Matrix3d covarianceOf(const Landmark& landmark, const BundleProblem& problem) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (const LandmarkObservation& observation : landmark.observations) {
    const CameraPose& camera = problem.cameras[observation.image];
    const Eigen::Vector3d point = camera.toCamera(landmark.position_m);
    Eigen::Matrix<double, 2, 3> ray_by_point;
    ray_by_point << 1.0, 0.0, -point.x() / point.z(), 0.0, 1.0, -point.y() / point.z();
    ray_by_point *= 1.0 / (point.z() * observation.sigma_px);
    Eigen::Matrix2d by_ray;
    problem.lensOf(observation.image).project(point.hnormalized(), &by_ray);
    const Eigen::Matrix<double, 2, 3> by_landmark =
        by_ray * ray_by_point * camera.rotation.conjugate().toRotationMatrix();
    information += by_landmark.transpose() * by_landmark;
  }
  return information.ldlt().solve(Eigen::Matrix3d::Identity());
}

void addObservation(const Landmark& landmark, const Eigen::Matrix3d& covariance, std::uint32_t feature,
                    std::uint32_t id, ImageGeometry& image) {
  const Eigen::Vector3d offset = landmark.position_m - image.camera.position_m;
  const Eigen::Vector3d ray = offset.normalized();
  const double along_m2 = ray.dot(covariance * ray);
  const double across_m2 = 0.5 * (covariance.trace() - along_m2);
  if (!(std::isfinite(along_m2) && along_m2 > 0.0 && across_m2 > 0.0)) return;
  image.landmarks.push_back({feature, id, offset.cast<float>(), static_cast<float>(std::sqrt(along_m2)),
                             static_cast<float>(std::sqrt(across_m2))});
}

}  // namespace visual_localization

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/lens_correction.h"
#include "visual_localization/geometry/camera_pose.h"
#include "visual_localization/geometry/image_geometry.h"

namespace visual_localization {

constexpr double kNearest_m = 0.05;  ///< a landmark closer to a camera's plane than this has no projection

/// Where an image shows a landmark.
struct LandmarkObservation {
  std::uint32_t image = 0;
  std::uint32_t feature = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< as recorded, by the lens of the image's session
  double sigma_px = 1.0;                            ///< of each coordinate
};

/// A point of the world and the images that show it.
struct Landmark {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< map frame
  std::vector<LandmarkObservation> observations;
};

/// What a satellite receiver says about where its antenna was when an image was taken.
struct PositionObservation {
  std::uint32_t image = 0;
  Eigen::Vector2d east_north_m = Eigen::Vector2d::Zero();
  double sigma_m = 0.3;
  Eigen::Vector2d velocity_m_s = Eigen::Vector2d::Zero();  ///< of the antenna
  bool believed = true;  ///< always counts; otherwise only where the images agree with it
};

/// What it says about how high the antenna was.
struct HeightObservation {
  std::uint32_t image = 0;
  double up_m = 0.0;
  double sigma_m = 1.0;
};

/// How a robot drives on a road.
struct RoadTravel {
  double direction = 1.0;  ///< 1 ahead, -1 backwards
  double slope = 0.0;      ///< rise over run ahead, as far as it is known
};

/// A lens: its published calibration, and how the images say it differs. By default pixels are normalised coordinates.
struct BundleLens {
  Intrinsics published{{}, 1.0, 1.0, 0.0, 0.0, Distortion::kPlumbBob, {}};
  LensCorrection correction = LensCorrection::Zero();
};

/// What the images of one recording have in common.
struct BundleSession {
  std::size_t begin = 0;                                         ///< its first camera
  std::size_t lens = 0;                                          ///< of its images, among those of the problem
  Eigen::Quaterniond mounting = Eigen::Quaterniond::Identity();  ///< see AveragedRotations; as it is known before
  Eigen::Vector3d mounting_rad = Eigen::Vector3d::Zero();        ///< see AveragedRotations
  Eigen::Vector3d mounting_sigma_rad{0.5, 0.5, 0.02};            ///< of that: pitch, yaw, roll of a level camera
  Eigen::Vector2d fix_bias_m = Eigen::Vector2d::Zero();  ///< its fixes are this far off; not for a single session
  double fix_bias_sigma_m = 0.3;                         ///< of that, per axis
  Eigen::Vector3d antenna_m = Eigen::Vector3d::Zero();   ///< in the camera's optical frame; known
  double fix_height_m = 0.0;                             ///< its altitudes are this far off
  double fix_delay_s = 0.0;  ///< a fix says where the antenna was this long before its stamp, by the clock of images
  double fix_delay_sigma_s = 0.1;
};

/// Cameras session by session, each in order of time, what they saw, and what is known besides.
struct BundleProblem {
  std::vector<CameraPose> cameras;
  std::vector<Landmark> landmarks;
  std::vector<PositionObservation> positions;
  std::vector<HeightObservation> heights;
  std::vector<RoadTravel> road;  ///< at each camera
  std::vector<BundleSession> sessions;
  std::vector<BundleLens> lenses = {{}};

  const BundleSession& sessionOf(std::size_t camera) const;
  LensProjection lensOf(std::size_t camera) const;
};

/// From the camera before to the one behind it, metres; nothing where it hardly moves, since its direction of travel
/// says little there. There must be both, in one session.
std::optional<Eigen::Vector3d> wayAt(const BundleProblem& problem, std::size_t camera);

/// Distance of where a landmark is seen from where it projects to, pixels; infinite behind the camera.
double reprojectionError_px(const BundleProblem& problem, const Landmark& landmark,
                            const LandmarkObservation& observation);

/// Of a landmark's position (m2, map frame) among cameras that stand still.
Eigen::Matrix3d covarianceOf(const Landmark& landmark, const BundleProblem& problem);
/// Appends the landmark to an image that shows it; not one whose covariance is none.
void addObservation(const Landmark& landmark, const Eigen::Matrix3d& covariance, std::uint32_t feature,
                    std::uint32_t id, ImageGeometry& image);

}  // namespace visual_localization

#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geometry/lens_correction.h"
#include "visual_localization/geometry/camera_pose.h"
#include "visual_localization/geometry/image_geometry.h"

namespace visual_localization {

/// Where an image shows a landmark.
struct LandmarkSighting {
  std::uint32_t image = 0;
  std::uint32_t feature = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< as recorded, by the lens of the image's session
  double sigma_px = 1.0;                            ///< of each coordinate
};

/// A point of the world and the images that show it.
struct Landmark {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< map frame
  std::vector<LandmarkSighting> sightings;
};

/// What a satellite receiver says about where its antenna was when an image was taken.
struct PositionObservation {
  std::uint32_t image = 0;
  Eigen::Vector2d east_north_m = Eigen::Vector2d::Zero();
  double sigma_m = 0.3;
  Eigen::Vector2d velocity_m_s = Eigen::Vector2d::Zero();  ///< of the antenna
  bool believed = true;  ///< it always has a say; otherwise only where the images agree with it
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

struct BundleConfig {
  double landmark_loss = 2.5;  ///< scale of the Cauchy loss of a sighting, sigmas
  double position_loss = 1.0;  ///< scale of the loss of a fix, sigmas: Cauchy's if believed, else Geman and McClure's
  Eigen::Vector3d tilt_sigma_rad{0.02, 0.1, 0.02};  ///< of a robot about its direction of travel: pitch, yaw, roll
  double slope_sigma = 0.1;                         ///< rise over run
  int max_iterations = 50;
  double tolerance = 1e-4;  ///< relative change of the cost at which it ends
  /// One sigma of each entry of a calibration; zero: all calibrations stay as they are.
  LensCorrection lens_sigma = LensCorrection::Zero();
};

/// Cameras that are adjusted together. Those that are known and do not move stand still; what others saw does not
/// count. All of them unless said otherwise.
struct BundleWindow {
  static constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

  const std::vector<std::size_t>* ranks = nullptr;  ///< of the cameras, which the limits are about; none: their indices
  std::size_t begin = 0;                            ///< the first camera that moves
  std::size_t end = kAll;                           ///< the one behind the last that moves
  std::size_t known_begin = 0;
  std::size_t known_end = kAll;

  std::size_t rank(std::size_t camera) const { return ranks != nullptr ? (*ranks)[camera] : camera; }
  bool moves(std::size_t camera) const { return rank(camera) >= begin && rank(camera) < end; }
  bool knows(std::size_t camera) const { return rank(camera) >= known_begin && rank(camera) < known_end; }
};

/// Moves the cameras of the window, the landmarks that they see, mountings, biases and delays of their sessions, and
/// their lenses where these are free, to where all observations agree best. Returns the final cost.
double adjust(BundleProblem& problem, const BundleConfig& config, const BundleWindow& window = {});

/// Turns, scales and shifts a single session as a whole, and turns its mounting, to where fixes, altitudes, slopes and
/// level robots agree best. What images see of each other does not change, and an adjustment of all of them hardly
/// feels it: it would need hundreds of iterations. Nothing without a believed fix.
void moveAsOne(BundleProblem& problem, const BundleConfig& config);

/// What an adjustment does not tell by its result: standard deviations of what the images of a session share.
struct SharedSigmas {
  LensCorrection lens = LensCorrection::Zero();  ///< of the first lens
  double fix_delay_s = 0.0;                      ///< of the first session
  double position_m = 0.0;                       ///< of a camera that moves, per horizontal axis; of some the median
};
/// Of an adjusted problem, by the curvature of its cost there. Zero where nothing depends on it.
SharedSigmas sharedSigmas(BundleProblem problem, const BundleConfig& config, const BundleWindow& window = {});

/// Distance of where a landmark is seen from where it projects to, pixels; infinite behind the camera.
double reprojectionError_px(const BundleProblem& problem, const Landmark& landmark, const LandmarkSighting& sighting);

/// Of a landmark's position (m2, map frame) among cameras that stand still.
Eigen::Matrix3d covarianceOf(const Landmark& landmark, const BundleProblem& problem);
/// Appends the landmark to an image that shows it; not one whose covariance is none.
void addSighting(const Landmark& landmark, const Eigen::Matrix3d& covariance, std::uint32_t feature, std::uint32_t id,
                 ImageGeometry& image);

/// How a camera of a map moves: a turn about itself, then a shift.
struct PoseCorrection {
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();  ///< about the map's axes
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();         ///< east, north, up

  bool isNone() const { return shift_m.isZero(0.0) && turn.vec().isZero(0.0); }
  CameraPose of(const CameraPose& camera) const {
    return {(turn * camera.rotation).normalized(), camera.position_m + shift_m};
  }
  /// The same of a pose that keeps its place beside a camera at `about_m`, which moves like this.
  CameraPose of(const CameraPose& pose, const Eigen::Vector3d& about_m) const {
    return {(turn * pose.rotation).normalized(), about_m + turn * (pose.position_m - about_m) + shift_m};
  }
  /// This one first.
  PoseCorrection then(const PoseCorrection& other) const {
    return {(other.turn * turn).normalized(), shift_m + other.shift_m};
  }
};

/// Where a camera is by the landmarks of another map.
struct PoseTie {
  std::size_t camera = 0;
  CameraPose pose;
  /// Position (metres), then rotation (radians), about the map's axes.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Identity();
};

/// How poses of a map err: alike where they are close, each its own way where they are far apart (a Gauss-Markov
/// process along the path, as the errors of a receiver are).
struct CorrectionModel {
  double sigma_m = 0.5;     ///< of each axis of the position
  double sigma_rad = 0.01;  ///< of each axis of the rotation
  double length_m = 50.0;   ///< after which errors have little to do with each other
};

/// The most likely corrections of `cameras` (those of a session follow each other) by their ties, least squares with a
/// Cauchy loss. What `neighbours`, pairs of cameras, have seen of each other stays. Heights are moved by the median of
/// the ties first: two sessions' altitudes are metres apart. No ties: no corrections.
std::vector<PoseCorrection> correctionsBy(const std::vector<PoseTie>& ties, const std::vector<CameraPose>& cameras,
                                          const std::vector<std::pair<std::size_t, std::size_t>>& neighbours,
                                          const CorrectionModel& model = {});

}  // namespace visual_localization

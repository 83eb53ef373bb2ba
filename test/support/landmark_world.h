#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include <Eigen/Core>

#include "geometry/session_geometry.h"
#include "visual_localization/camera/camera_model.h"
#include "visual_localization/features/local_features.h"
#include "visual_localization/features/sift.h"
#include "visual_localization/geometry/camera_pose.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization::test {

constexpr double kKeypointSigma_px = 0.3;

/// 640 x 480 pixels, focal length 450 pixels, a lens that bends a little.
CameraModel streetCamera();

/// A thing with a look of its own. Most stand still.
struct WorldPoint {
  using Descriptor = std::array<std::uint8_t, kSiftDimension>;

  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d motion_m = Eigen::Vector3d::Zero();  ///< from one image to the next
  Descriptor descriptor{};
};

WorldPoint randomPoint(const Eigen::Vector3d& position_m, std::mt19937& random);

/// An image of the world.
struct View {
  LocalFeatures features;
  std::vector<std::size_t> points;  ///< which one each feature shows
};

/// What `camera` sees of `world` at `pose` within 25 m: exact projections and normal noise. `image`: how often the
/// things that move have done so.
View viewOf(const std::vector<WorldPoint>& world, const CameraModel& camera, const CameraPose& pose, double noise_px,
            std::mt19937& random, std::size_t image = 0);

/// How a street is driven: straight on, a turn to the left, straight on, a turn to the right, straight on.
struct StreetDrive {
  std::size_t images = 45;
  double spacing_m = 1.0;
  double turn_rad = 1.5;   ///< of either turn, on a third of the way from the middle of a straight to that of the next
  double pitch_rad = 0.0;  ///< of the camera on the robot, upwards positive
  double yaw_rad = 0.0;    ///< of the camera on the robot, to the right positive
  double slope = 0.0;      ///< rise over run in the middle third
  double roll_rad = 0.0;   ///< of the camera, clockwise
  bool reverses = false;   ///< backwards in the last fifth: `travel_yaw_rad` stays where the robot looks
};

/// Where the robot is and where it drives to, the camera on it and the time.
struct DrivenPose {
  CameraPose camera;
  double travel_yaw_rad = 0.0;
};

/// Of the camera, turned against a level one that looks where the robot does.
Eigen::Quaterniond mountingOf(const StreetDrive& street);

std::vector<DrivenPose> drive(const StreetDrive& street);

/// Points at random, 2 to 10 m beside the street and up to 20 m beyond its end.
std::vector<WorldPoint> pointsAlong(const std::vector<DrivenPose>& poses, double points_per_m, std::mt19937& random);

/// A drive that was recorded: one image a second, five fixes a second.
struct RecordedDrive {
  CameraModel camera = streetCamera();
  std::vector<DrivenPose> truth;
  std::vector<std::shared_ptr<const LocalFeatures>> views;
  std::vector<MapFix> fixes;

  /// With the path that cleaning makes of the fixes. This must live longer.
  UnadjustedSession unadjusted() const;
};

/// Images of `world`, and fixes with an error of `fix_noise_m` (one sigma).
RecordedDrive record(const std::vector<DrivenPose>& poses, const std::vector<WorldPoint>& world, double fix_noise_m,
                     std::mt19937& random, const CameraModel& camera = streetCamera());

/// The map that the adjustment of this drive makes: every image of it, with its features and landmarks.
std::shared_ptr<const TrainingMap> mapOf(const RecordedDrive& drive);

/// Reflected signals: from `begin` to `end` (shares of the drive) the fixes bend aside, by `most_m` in the middle.
void bendFixes(RecordedDrive& drive, double begin, double end, double most_m);

/// Horizontal root mean square.
double pathError_m(const std::vector<Eigen::Vector2d>& positions_m, const std::vector<DrivenPose>& truth);

}  // namespace visual_localization::test

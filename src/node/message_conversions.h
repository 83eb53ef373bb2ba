#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include <geometry_msgs/PoseArray.h>
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/Quaternion.h>
#include <nav_msgs/Path.h>
#include <sensor_msgs/NavSatFix.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Header.h>
#include <visual_localization/FromLL.h>
#include <visual_localization/LocalizationStatus.h>
#include <visual_localization/Swarm.h>
#include <visual_localization/ToLL.h>
#include <visualization_msgs/Marker.h>
#include <visualization_msgs/MarkerArray.h>

#include "visual_localization/camera/camera_model.h"
#include "visual_localization/localization/estimate.h"
#include "visual_localization/localization/particles.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// Rotation about z, ROS convention: 0 = along x (east), counter-clockwise.
geometry_msgs::Quaternion quaternionFromYaw(double yaw_rad);

/// True when every number that would be published is finite.
bool isFinite(const Estimate& estimate);
bool isFinite(const Particle& particle);

/// A metric pose: that of the robot, with the covariance of all 6 axes (x, y, z, rotation about x, y, z of the map),
/// map included. Otherwise position, heading and their covariance; height, roll and pitch are zero. `header`: map
/// frame.
geometry_msgs::PoseWithCovarianceStamped toPose(const Estimate& estimate, const std_msgs::Header& header);

/// The same position as latitude and longitude; the map knows no altitude. No fix while the position is unknown or
/// lost. `header`: frame of the robot, as for a GPS receiver.
sensor_msgs::NavSatFix toFix(const Estimate& estimate, const std_msgs::Header& header);

/// Everything but latency and counts of images, which only the node knows.
LocalizationStatus toStatus(const Estimate& estimate, const std_msgs::Header& header);

/// Particles in the map frame. Heading is the direction of the velocity, zero for a particle at rest.
geometry_msgs::PoseArray toPoseArray(const std::vector<Particle>& particles, const std_msgs::Header& header);
Swarm toSwarm(const std::vector<Particle>& particles, const std_msgs::Header& header);
/// Fields x, y, z and intensity (the weight), 32-bit floats, so that rviz can colour by weight.
sensor_msgs::PointCloud2 toPointCloud(const std::vector<Particle>& particles, const std_msgs::Header& header);

// Between places on the earth and in the map (null: none is loaded). What is refused says why in its message.
FromLL::Response fromLL(const TrainingMap* map, const FromLL::Request& request);
ToLL::Response toLL(const TrainingMap* map, const ToLL::Request& request);

/// The camera at the estimate's metric pose: lines along the corners of its field of view, and a roof over the upper
/// edge. Takes the one before away when the pose is not metric. `header`: map frame.
visualization_msgs::Marker toCameraMarker(const Estimate& estimate, const std::optional<CameraModel>& camera,
                                          const std_msgs::Header& header);

/// Where the robot drove, as far as it was tracked. Not thread-safe.
class DrivenPath {
 public:
  static constexpr std::size_t kMost = 5000;  ///< poses that are remembered: the last ones
  static constexpr double kStep_m = 0.2;      ///< a pose nearer to the one before is left out

  /// A pose of the state TRACKING; where landmarks are used a metric one. No other changes anything. `header`: map
  /// frame, stamp of the image.
  void add(const Estimate& estimate, const std_msgs::Header& header);
  void clear() { poses_.clear(); }
  nav_msgs::Path toPath(const std_msgs::Header& header) const;

 private:
  std::deque<geometry_msgs::PoseStamped> poses_;  ///< oldest first
};

/// The recorded path, image by image, session by session. Of a map with more than 20000 images only every second one,
/// or every third, and so on: here and in the markers.
nav_msgs::Path toPath(const TrainingMap& map, const std::string& frame_id);

/// Positions and headings of the training images, per session, and the landmarks as points coloured by height: each
/// landmark once, of at most 5000 images and at most 200000 points, evenly chosen. Begins with a marker that deletes
/// those of an earlier map.
visualization_msgs::MarkerArray toMarkers(const TrainingMap& map, const std::string& frame_id);

}  // namespace visual_localization

#pragma once

#include <optional>
#include <string>
#include <vector>

#include <geometry_msgs/PoseArray.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/Quaternion.h>
#include <nav_msgs/Odometry.h>
#include <sensor_msgs/NavSatFix.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Header.h>
#include <visual_localization/FromLL.h>
#include <visual_localization/LocalizationStatus.h>
#include <visual_localization/Reason.h>
#include <visual_localization/Swarm.h>
#include <visual_localization/ToLL.h>

#include "visual_localization/localization/estimate.h"
#include "visual_localization/localization/particles.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// About z: 0 = along x (east), counter-clockwise.
geometry_msgs::Quaternion quaternionFromYaw(double yaw_rad);

/// Every number that would be published.
bool isFinite(const Estimate& estimate);
bool isFinite(const Particle& particle);

/// A metric pose: that of the robot, with the covariance of all 6 axes (x, y, z, rotation about x, y, z of the map),
/// map included. Otherwise position, heading and their covariance; height, roll and pitch are zero. `header`: map
/// frame.
geometry_msgs::PoseWithCovarianceStamped toPose(const Estimate& estimate, const std_msgs::Header& header);

/// With the covariance of the image alone, in relation to the map, for a filter. Nothing unless a METRIC pose is
/// TRACKING.
std::optional<geometry_msgs::PoseWithCovarianceStamped> toMetricPose(const Estimate& estimate,
                                                                     const std_msgs::Header& header);

/// The same for those who take odometry. The twist is unknown: its variances are 1e6.
nav_msgs::Odometry toOdometry(const geometry_msgs::PoseWithCovarianceStamped& metric_pose,
                              const std::string& base_frame_id);

/// No altitude, and no fix while the position is unknown or lost. `header`: frame of the robot, as for a GPS receiver.
sensor_msgs::NavSatFix toFix(const Estimate& estimate, const std_msgs::Header& header);

Reason toMessage(const Why& why);

/// But for latency and counts of images, which only the node knows.
LocalizationStatus toStatus(const Estimate& estimate, const std_msgs::Header& header);

/// Map frame. Heading is the direction of the velocity, zero at rest.
geometry_msgs::PoseArray toPoseArray(const std::vector<Particle>& particles, const std_msgs::Header& header);
Swarm toSwarm(const std::vector<Particle>& particles, const std_msgs::Header& header);
/// Fields x, y, z and intensity (the weight), 32-bit floats.
sensor_msgs::PointCloud2 toPointCloud(const std::vector<Particle>& particles, const std_msgs::Header& header);

// Null: no map is loaded. What is refused says why in its message.
FromLL::Response fromLL(const TrainingMap* map, const FromLL::Request& request);
ToLL::Response toLL(const TrainingMap* map, const ToLL::Request& request);

}  // namespace visual_localization

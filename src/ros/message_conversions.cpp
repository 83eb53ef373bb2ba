#include "visual_localization/ros/message_conversions.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <sensor_msgs/point_cloud2_iterator.h>

namespace visual_localization {
namespace {

constexpr std::size_t kRow = 6;              ///< of a pose's covariance: x, y, z and three rotations
constexpr double kUnknownAltitude_m2 = 1e6;  ///< the map is flat and says nothing about height

geometry_msgs::Pose poseOf(const Eigen::Vector2d& position_m, double yaw_rad) {
  geometry_msgs::Pose pose;
  pose.position.x = position_m.x();
  pose.position.y = position_m.y();
  pose.orientation = quaternionFromYaw(yaw_rad);
  return pose;
}

geometry_msgs::Pose poseOf(const Particle& particle) {
  const bool moves = particle.velocity_m.squaredNorm() > 0.0;
  return poseOf(particle.position_m, moves ? std::atan2(particle.velocity_m.y(), particle.velocity_m.x()) : 0.0);
}

bool positionIsKnown(LocalizationState state) {
  return state == LocalizationState::kTracking || state == LocalizationState::kUncertain;
}

std::uint32_t count(std::size_t number) {
  constexpr std::size_t kMax = std::numeric_limits<std::uint32_t>::max();
  return static_cast<std::uint32_t>(number < kMax ? number : kMax);
}

}  // namespace

geometry_msgs::Quaternion quaternionFromYaw(double yaw_rad) {
  geometry_msgs::Quaternion rotation;
  rotation.z = std::sin(0.5 * yaw_rad);
  rotation.w = std::cos(0.5 * yaw_rad);
  return rotation;
}

bool isFinite(const Estimate& estimate) {
  const PoseEstimate& pose = estimate.pose;
  return pose.position_m.allFinite() && pose.covariance_m2.allFinite() && std::isfinite(pose.yaw_rad) &&
         std::isfinite(pose.yaw_variance_rad2) && std::isfinite(pose.geodetic.latitude_deg) &&
         std::isfinite(pose.geodetic.longitude_deg) && std::isfinite(pose.geodetic.altitude_m) &&
         std::isfinite(estimate.best.similarity) && estimate.spread_m.allFinite() &&
         std::isfinite(estimate.place_ratio) && std::isfinite(estimate.course_residual_m);
}

bool isFinite(const Particle& particle) {
  return particle.position_m.allFinite() && particle.velocity_m.allFinite() && std::isfinite(particle.weight);
}

geometry_msgs::PoseWithCovarianceStamped toPose(const Estimate& estimate, const std_msgs::Header& header) {
  geometry_msgs::PoseWithCovarianceStamped message;
  message.header = header;
  message.pose.pose = poseOf(estimate.pose.position_m, estimate.pose.yaw_rad);
  const Eigen::Matrix2d& covariance = estimate.pose.covariance_m2;
  message.pose.covariance[0] = covariance(0, 0);
  message.pose.covariance[1] = covariance(0, 1);
  message.pose.covariance[kRow] = covariance(1, 0);
  message.pose.covariance[kRow + 1] = covariance(1, 1);
  message.pose.covariance[5 * kRow + 5] = estimate.pose.yaw_variance_rad2;
  return message;
}

sensor_msgs::NavSatFix toFix(const Estimate& estimate, const std_msgs::Header& header) {
  sensor_msgs::NavSatFix message;
  message.header = header;
  message.status.status = positionIsKnown(estimate.state) ? sensor_msgs::NavSatStatus::STATUS_FIX
                                                          : sensor_msgs::NavSatStatus::STATUS_NO_FIX;
  message.latitude = estimate.pose.geodetic.latitude_deg;
  message.longitude = estimate.pose.geodetic.longitude_deg;
  message.altitude = estimate.pose.geodetic.altitude_m;
  const Eigen::Matrix2d& covariance = estimate.pose.covariance_m2;
  message.position_covariance = {
      covariance(0, 0), covariance(0, 1), 0.0, covariance(1, 0), covariance(1, 1), 0.0, 0.0, 0.0, kUnknownAltitude_m2};
  message.position_covariance_type = sensor_msgs::NavSatFix::COVARIANCE_TYPE_APPROXIMATED;
  return message;
}

LocalizationStatus toStatus(const Estimate& estimate, const std_msgs::Header& header) {
  LocalizationStatus message;
  message.header = header;
  message.state = static_cast<std::uint8_t>(estimate.state);
  message.state_name = toString(estimate.state);
  message.best_similarity = estimate.best.similarity;
  message.best_matches = count(estimate.best.matches);
  message.best_scale = estimate.best.scale;
  message.best_image = estimate.comparisons > 0 ? static_cast<std::int64_t>(estimate.best_image) : -1;
  message.features = static_cast<std::uint8_t>(estimate.features);
  message.comparisons = count(estimate.comparisons);
  message.features_extracted = count(estimate.features_extracted);
  message.features_kept = count(estimate.features_kept);
  message.place_ratio = estimate.place_ratio;
  message.course_residual = estimate.course_residual_m;
  message.v0 = estimate.tuning.v0;
  message.speed_ema = estimate.tuning.speed_ema;
  message.quantum_share = estimate.tuning.quantum_share;
  message.phi2 = estimate.tuning.phi2;
  message.sigma_x = estimate.spread_m.x();
  message.sigma_y = estimate.spread_m.y();
  message.extract_ms = estimate.times.extract_ms;
  message.match_ms = estimate.times.match_ms;
  message.update_ms = estimate.times.update_ms;
  return message;
}

geometry_msgs::PoseArray toPoseArray(const std::vector<Particle>& particles, const std_msgs::Header& header) {
  geometry_msgs::PoseArray message;
  message.header = header;
  message.poses.reserve(particles.size());
  for (const Particle& particle : particles) message.poses.push_back(poseOf(particle));
  return message;
}

Swarm toSwarm(const std::vector<Particle>& particles, const std_msgs::Header& header) {
  Swarm message;
  message.header = header;
  message.particles.reserve(particles.size());
  for (const Particle& particle : particles) {
    SwarmParticle one;
    one.pose = poseOf(particle);
    one.velocity.x = particle.velocity_m.x();
    one.velocity.y = particle.velocity_m.y();
    one.weight = particle.weight;
    one.kind = static_cast<std::uint8_t>(particle.kind);
    message.particles.push_back(one);
  }
  return message;
}

sensor_msgs::PointCloud2 toPointCloud(const std::vector<Particle>& particles, const std_msgs::Header& header) {
  sensor_msgs::PointCloud2 message;
  message.header = header;
  sensor_msgs::PointCloud2Modifier modifier(message);
  constexpr int kFloat = sensor_msgs::PointField::FLOAT32;
  modifier.setPointCloud2Fields(4, "x", 1, kFloat, "y", 1, kFloat, "z", 1, kFloat, "intensity", 1, kFloat);
  modifier.resize(particles.size());
  if (particles.empty()) return message;  // the iterator takes the address of the first point
  sensor_msgs::PointCloud2Iterator<float> point(message, "x");
  for (const Particle& particle : particles) {
    point[0] = static_cast<float>(particle.position_m.x());
    point[1] = static_cast<float>(particle.position_m.y());
    point[2] = 0.0F;
    point[3] = static_cast<float>(particle.weight);
    ++point;
  }
  return message;
}

}  // namespace visual_localization

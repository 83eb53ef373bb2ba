#include "node/message_conversions.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <sensor_msgs/point_cloud2_iterator.h>
#include <tf2_eigen/tf2_eigen.h>

#include "base/text.h"
#include "visual_localization/geo/trajectory.h"

namespace visual_localization {
namespace {

constexpr std::size_t kRow = 6;              ///< of a pose's covariance: x, y, z and three rotations
constexpr double kUnknownAltitude_m2 = 1e6;  ///< the map knows heights, but not above which level
// Makes a metric covariance invertible; far below what images allow.
constexpr double kLeastPositionSigma_m = 1e-3;
constexpr double kLeastRotationSigma_rad = 1e-4;

geometry_msgs::Pose poseOf(const Eigen::Vector2d& position_m, double yaw_rad) {
  geometry_msgs::Pose pose;
  pose.position.x = position_m.x();
  pose.position.y = position_m.y();
  pose.orientation = quaternionFromYaw(yaw_rad);
  return pose;
}

/// Symmetric to the last bit.
MetricPose::Covariance invertible(MetricPose::Covariance covariance) {
  covariance = (0.5 * (covariance + covariance.transpose())).eval();
  covariance.diagonal().head<3>().array() += kLeastPositionSigma_m * kLeastPositionSigma_m;
  covariance.diagonal().tail<3>().array() += kLeastRotationSigma_rad * kLeastRotationSigma_rad;
  return covariance;
}

/// Map included.
MetricPose::Covariance fullCovariance(const MetricPose& metric) {
  return invertible(metric.covariance + metric.map_covariance);
}

Eigen::Matrix2d positionCovariance(const Estimate& estimate) {
  if (estimate.metric) return fullCovariance(*estimate.metric).topLeftCorner<2, 2>();
  return estimate.pose.covariance_m2;
}

bool isFinite(const MetricPose& metric) {
  return metric.base.matrix().allFinite() && fullCovariance(metric).allFinite() &&
         std::isfinite(metric.reprojection_px);
}

geometry_msgs::PoseWithCovariance withCovariance(const MetricPose& metric, const MetricPose::Covariance& covariance) {
  geometry_msgs::PoseWithCovariance pose;
  pose.pose = tf2::toMsg(metric.base);
  Eigen::Map<MetricPose::Covariance>(pose.covariance.data()) = covariance;  // symmetric: rows are columns
  return pose;
}

geometry_msgs::PoseWithCovariance withCovariance(const PoseEstimate& estimate) {
  geometry_msgs::PoseWithCovariance pose;
  pose.pose = poseOf(estimate.position_m, estimate.yaw_rad);
  const Eigen::Matrix2d& covariance = estimate.covariance_m2;
  pose.covariance[0] = covariance(0, 0);
  pose.covariance[1] = covariance(0, 1);
  pose.covariance[kRow] = covariance(1, 0);
  pose.covariance[kRow + 1] = covariance(1, 1);
  pose.covariance[5 * kRow + 5] = estimate.yaw_variance_rad2;
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

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// Unknown in a status that answers no image.
void addSource(const Estimate& estimate, LocalizationStatus& message) {
  message.source = static_cast<std::uint8_t>(estimate.source);
  message.source_name = toString(estimate.source);
  message.images_since_metric = count(estimate.images_since_metric);
  message.focal_scale = estimate.focal_scale;
  message.sigma_position = message.sigma_heading = message.mean_grey = kUnknown;
  if (message.best_image < 0) return;
  message.mean_grey = estimate.image.statistics.mean_grey;
  message.sigma_position = estimate.sigma_m();
  message.sigma_heading = estimate.sigmaYaw_rad();
  if (!estimate.metric) return;
  message.inliers = count(estimate.metric->inliers);
  message.reprojection = estimate.metric->reprojection_px;
  message.map_sigma_position = estimate.metric->mapSigma_m();
  message.map_sigma_heading = estimate.metric->mapSigmaYaw_rad();
}

void addBelief(const Estimate& estimate, LocalizationStatus& message) {
  message.reason = toMessage(estimate.why);
  message.probability = estimate.evidence.probability.value_or(kUnknown);
  message.min_probability = estimate.threshold.value_or(kUnknown);
  message.off_map = estimate.belief.off_map;
  const std::optional<PlaceBelief::Place>& rival = estimate.belief.rival;
  message.rival_image = rival ? static_cast<std::int64_t>(rival->training_image) : -1;
  message.rival_x = rival ? rival->position_m.x() : kUnknown;
  message.rival_y = rival ? rival->position_m.y() : kUnknown;
  message.rival_probability = rival ? rival->probability : kUnknown;
  message.unconfirmed = static_cast<std::uint32_t>(estimate.unconfirmed);
}

}  // namespace

Reason toMessage(const Why& why) {
  Reason message;
  message.value = static_cast<std::uint8_t>(why.reason);
  message.name = textOf(why.reason).name;
  message.sentence = describe(why);
  message.advice = textOf(why.reason).advice;
  message.figure = why.figure;
  message.x = why.position_m.x();
  message.y = why.position_m.y();
  return message;
}

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
         std::isfinite(estimate.tracked.best.similarity) && estimate.tracked.spread_m.allFinite() &&
         std::isfinite(estimate.evidence.place_ratio) && std::isfinite(estimate.motion_residual_m) &&
         (!estimate.metric || isFinite(*estimate.metric));
}

bool isFinite(const Particle& particle) {
  return particle.position_m.allFinite() && particle.velocity_m.allFinite() && std::isfinite(particle.weight);
}

geometry_msgs::PoseWithCovarianceStamped toPose(const Estimate& estimate, const std_msgs::Header& header) {
  geometry_msgs::PoseWithCovarianceStamped message;
  message.header = header;
  message.pose = estimate.metric ? withCovariance(*estimate.metric, fullCovariance(*estimate.metric))
                                 : withCovariance(estimate.pose);
  return message;
}

std::optional<geometry_msgs::PoseWithCovarianceStamped> toMetricPose(const Estimate& estimate,
                                                                     const std_msgs::Header& header) {
  if (!estimate.metric || estimate.state != LocalizationState::kTracking) return std::nullopt;
  geometry_msgs::PoseWithCovarianceStamped message;
  message.header = header;
  message.pose = withCovariance(*estimate.metric, invertible(estimate.metric->covariance));
  return message;
}

nav_msgs::Odometry toOdometry(const geometry_msgs::PoseWithCovarianceStamped& metric_pose,
                              const std::string& base_frame_id) {
  constexpr double kUnknownTwist = 1e6;
  nav_msgs::Odometry message;
  message.header = metric_pose.header;
  message.child_frame_id = base_frame_id;
  message.pose = metric_pose.pose;
  for (std::size_t axis = 0; axis < kRow; ++axis) message.twist.covariance[axis * kRow + axis] = kUnknownTwist;
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
  const Eigen::Matrix2d covariance = positionCovariance(estimate);
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
  message.best_similarity = estimate.tracked.best.similarity;
  message.best_matches = count(estimate.tracked.best.matches);
  message.best_scale = estimate.tracked.best.scale;
  message.best_image = estimate.comparisons > 0 ? static_cast<std::int64_t>(estimate.tracked.best_image) : -1;
  message.session = oneLine(estimate.session);
  message.features = static_cast<std::uint8_t>(estimate.evidence.features);
  message.comparisons = count(estimate.comparisons);
  message.swept = count(estimate.swept);
  message.features_extracted = count(estimate.image.features_extracted);
  message.features_kept = count(estimate.image.features_kept);
  message.place_ratio = estimate.evidence.place_ratio;
  message.motion_residual = estimate.motion_residual_m;
  const TrackerReport& tracker = estimate.tracked.report;
  message.v0 = tracker.value("v0");
  message.speed_ema = tracker.value("speed_ema");
  message.swarm_speed = tracker.value("speed_mps");
  message.rival_weight = tracker.value("rival_weight");
  message.quantum_share = tracker.value("quantum_share");
  message.phi2 = tracker.value("phi2");
  message.sigma_x = estimate.tracked.spread_m.x();
  message.sigma_y = estimate.tracked.spread_m.y();
  message.extract_ms = estimate.image.extract_ms;
  message.match_ms = estimate.image.match_ms;
  message.update_ms = estimate.update_ms;
  addSource(estimate, message);
  addBelief(estimate, message);
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

FromLL::Response fromLL(const TrainingMap* map, const FromLL::Request& request) {
  FromLL::Response response;
  const GeodeticPoint point{request.latitude, request.longitude, 0.0};
  if (map == nullptr) {
    response.message = "no map is loaded";
  } else if (!isValid(point)) {
    response.message = "the latitude must be from -90 to 90 degrees, the longitude from -180 to 180";
  } else {
    const Eigen::Vector2d position_m = map->frame().toEastNorth(point);
    response.success = position_m.cwiseAbs().maxCoeff() <= kLargestCoordinate_m;
    response.message = response.success ? "" : "farther than 1000 km from the map";
    if (response.success) response.map_point = tf2::toMsg(Eigen::Vector3d(position_m.x(), position_m.y(), 0.0));
  }
  return response;
}

ToLL::Response toLL(const TrainingMap* map, const ToLL::Request& request) {
  ToLL::Response response;
  const Eigen::Vector2d position_m(request.map_point.x, request.map_point.y);
  if (map == nullptr) {
    response.message = "no map is loaded";
  } else if (!(position_m.array().abs() <= kLargestCoordinate_m).all()) {
    response.message = "x and y must be from -1000 to 1000 km, in metres";
  } else {
    const GeodeticPoint point = map->frame().toGeodetic(position_m);
    response.latitude = point.latitude_deg;
    response.longitude = point.longitude_deg;
    response.altitude = point.altitude_m;
    response.success = true;
  }
  return response;
}

}  // namespace visual_localization

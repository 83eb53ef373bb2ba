#include "node/message_conversions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <sensor_msgs/point_cloud2_iterator.h>
#include <tf2_eigen/tf2_eigen.h>

#include "base/numbers.h"
#include "base/text.h"
#include "survey/map_survey.h"
#include "visual_localization/geo/trajectory.h"

namespace visual_localization {
namespace {

constexpr std::size_t kRow = 6;              ///< of a pose's covariance: x, y, z and three rotations
constexpr double kUnknownAltitude_m2 = 1e6;  ///< the map knows heights, but not above which level
// Added to a metric covariance, so that it can always be inverted; far below what images allow.
constexpr double kLeastPositionSigma_m = 1e-3;
constexpr double kLeastRotationSigma_rad = 1e-4;

geometry_msgs::Pose poseOf(const Eigen::Vector2d& position_m, double yaw_rad) {
  geometry_msgs::Pose pose;
  pose.position.x = position_m.x();
  pose.position.y = position_m.y();
  pose.orientation = quaternionFromYaw(yaw_rad);
  return pose;
}

/// Of a metric pose, map included; symmetric to the last bit.
MetricPose::Covariance fullCovariance(const MetricPose& metric) {
  MetricPose::Covariance covariance = metric.covariance + metric.map_covariance;
  covariance = (0.5 * (covariance + covariance.transpose())).eval();
  covariance.diagonal().head<3>().array() += kLeastPositionSigma_m * kLeastPositionSigma_m;
  covariance.diagonal().tail<3>().array() += kLeastRotationSigma_rad * kLeastRotationSigma_rad;
  return covariance;
}

Eigen::Matrix2d positionCovariance(const Estimate& estimate) {
  if (estimate.metric) return fullCovariance(*estimate.metric).topLeftCorner<2, 2>();
  return estimate.pose.covariance_m2;
}

bool isFinite(const MetricPose& metric) {
  return metric.base.matrix().allFinite() && fullCovariance(metric).allFinite() &&
         std::isfinite(metric.reprojection_px);
}

geometry_msgs::PoseWithCovariance withCovariance(const MetricPose& metric) {
  geometry_msgs::PoseWithCovariance pose;
  pose.pose = tf2::toMsg(metric.base);
  Eigen::Map<MetricPose::Covariance>(pose.covariance.data()) = fullCovariance(metric);  // symmetric: rows are columns
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

/// What the pose rests on, and how well it is known. Sigmas stay 0 in a status that answers no image.
void addSource(const Estimate& estimate, LocalizationStatus& message) {
  message.source = static_cast<std::uint8_t>(estimate.source);
  message.source_name = toString(estimate.source);
  message.images_since_metric = count(estimate.images_since_metric);
  message.focal_scale = estimate.focal_scale;
  if (message.best_image < 0) return;
  message.sigma_position = estimate.sigma_m();
  message.sigma_heading = estimate.sigmaYaw_rad();
  if (!estimate.metric) return;
  message.inliers = count(estimate.metric->inliers);
  message.reprojection = estimate.metric->reprojection_px;
  message.map_sigma_position = estimate.metric->mapSigma_m();
  message.map_sigma_heading = estimate.metric->mapSigmaYaw_rad();
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
  message.pose = estimate.metric ? withCovariance(*estimate.metric) : withCovariance(estimate.pose);
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
  message.v0 = estimate.tracked.tuning.v0;
  message.speed_ema = estimate.tracked.tuning.speed_ema;
  message.swarm_speed = estimate.tracked.tuning.speed_mps;
  message.rival_weight = estimate.tracked.rival_weight;
  message.quantum_share = estimate.tracked.tuning.quantum_share;
  message.phi2 = estimate.tracked.tuning.phi2;
  message.sigma_x = estimate.tracked.spread_m.x();
  message.sigma_y = estimate.tracked.spread_m.y();
  message.extract_ms = estimate.image.extract_ms;
  message.match_ms = estimate.image.match_ms;
  message.update_ms = estimate.update_ms;
  addSource(estimate, message);
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

namespace {

using visualization_msgs::Marker;

constexpr double kRay_m = 6.0;  ///< from the optical centre to a corner
constexpr double kLine_m = 0.2;
constexpr double kRoof = 0.4;  ///< its height, as a share of the image's

/// Of the corners of the image: upper left, upper right, lower right, lower left. Where a lens shows nothing there, of
/// a smaller image.
std::array<Eigen::Vector2d, 4> cornersOf(const CameraModel& camera) {
  const Eigen::Vector2d middle_px(0.5 * (camera.size().width - 1), 0.5 * (camera.size().height - 1));
  const Eigen::Vector2d half_px(0.5 * camera.size().width, 0.5 * camera.size().height);
  std::array<Eigen::Vector2d, 4> corners;
  for (double share = 1.0; share > 0.4; share -= 0.05) {  // the middle half of an image is always usable
    std::vector<Eigen::Vector2d> pixels;
    for (const Eigen::Vector2d& side : {Eigen::Vector2d(-1.0, -1.0), Eigen::Vector2d(1.0, -1.0),
                                        Eigen::Vector2d(1.0, 1.0), Eigen::Vector2d(-1.0, 1.0)}) {
      pixels.emplace_back(middle_px + share * half_px.cwiseProduct(side));
    }
    const std::vector<Eigen::Vector2d> normalised = camera.undistort(pixels);
    bool usable = true;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      corners[i] = normalised[i];
      usable = usable && normalised[i].allFinite();
    }
    if (usable) break;
  }
  return corners;
}

void addLine(Marker& marker, const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) {
  if (!from_m.allFinite() || !to_m.allFinite()) return;
  marker.points.push_back(tf2::toMsg(from_m));
  marker.points.push_back(tf2::toMsg(to_m));
}

void addFrustum(Marker& marker, const CameraPose& pose, const CameraModel& camera) {
  std::array<Eigen::Vector3d, 4> corners_m;
  const std::array<Eigen::Vector2d, 4> corners = cornersOf(camera);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    corners_m[i] = pose.position_m + pose.rotation * (kRay_m * corners[i].homogeneous().normalized());
  }
  for (std::size_t i = 0; i < corners_m.size(); ++i) {
    addLine(marker, pose.position_m, corners_m[i]);
    addLine(marker, corners_m[i], corners_m[(i + 1) % corners_m.size()]);
  }
  const Eigen::Vector3d roof_m =
      0.5 * (corners_m[0] + corners_m[1]) + kRoof * 0.5 * (corners_m[0] + corners_m[1] - corners_m[2] - corners_m[3]);
  addLine(marker, corners_m[0], roof_m);
  addLine(marker, roof_m, corners_m[1]);
}

double distanceOf(const geometry_msgs::Point& a, const geometry_msgs::Point& b) {
  return std::hypot(a.x - b.x, a.y - b.y, a.z - b.z);
}

const char* const kPositions = "positions";  ///< namespace of the markers of training images
constexpr double kImageDiameter_m = 0.6;
constexpr double kHeadingLength_m = 1.5;
constexpr double kHeadingWidth_m = 0.12;
constexpr double kLandmarkSize_m = 0.25;
/// Of a larger map only every k-th image is shown: a message of a million poses would stop rviz.
constexpr std::size_t kMostShown = 20000;

constexpr std::size_t kMostLandmarks = 200000;
/// Landmarks are read from the map's file, which takes seconds for many more images.
constexpr std::size_t kMostRead = 5000;

struct Colour {
  float r, g, b;
};

/// From low to high; readable on white and for colour-blind people (the darker part of viridis).
constexpr std::array<Colour, 4> kHeightColours{
    {{0.27F, 0.00F, 0.33F}, {0.23F, 0.32F, 0.55F}, {0.13F, 0.57F, 0.55F}, {0.37F, 0.79F, 0.38F}}};

/// One per session; readable on white and for colour-blind people (Okabe and Ito).
constexpr std::array<Colour, 6> kSessionColours{{{0.00F, 0.45F, 0.70F},
                                                 {0.84F, 0.37F, 0.00F},
                                                 {0.00F, 0.62F, 0.45F},
                                                 {0.80F, 0.47F, 0.65F},
                                                 {0.90F, 0.62F, 0.00F},
                                                 {0.34F, 0.71F, 0.91F}}};

geometry_msgs::Point pointAt(const Eigen::Vector2d& position_m) {
  return tf2::toMsg(Eigen::Vector3d(position_m.x(), position_m.y(), 0.0));
}

visualization_msgs::Marker emptyMarker(const std::string& frame_id, const std::string& name_space, int session,
                                       int type) {
  visualization_msgs::Marker marker;
  marker.header.frame_id = frame_id;
  marker.ns = name_space;
  marker.id = session;
  marker.type = type;
  marker.action = visualization_msgs::Marker::ADD;
  marker.pose.orientation.w = 1.0;
  const Colour& colour = kSessionColours[static_cast<std::size_t>(session) % kSessionColours.size()];
  marker.color.r = colour.r;
  marker.color.g = colour.g;
  marker.color.b = colour.b;
  marker.color.a = 1.0F;
  return marker;
}

visualization_msgs::Marker emptyPositions(int session, const std::string& frame_id) {
  auto marker = emptyMarker(frame_id, kPositions, session, visualization_msgs::Marker::SPHERE_LIST);
  marker.scale.x = marker.scale.y = marker.scale.z = kImageDiameter_m;
  return marker;
}

visualization_msgs::Marker emptyHeadings(int session, const std::string& frame_id) {
  auto marker = emptyMarker(frame_id, "headings", session, visualization_msgs::Marker::LINE_LIST);
  marker.scale.x = kHeadingWidth_m;
  return marker;
}

/// `share` of the way from low to high, clamped.
std_msgs::ColorRGBA colourOfHeight(double share) {
  const double place = std::clamp(share, 0.0, 1.0) * static_cast<double>(kHeightColours.size() - 1);
  const std::size_t below = std::min(static_cast<std::size_t>(place), kHeightColours.size() - 2);
  const auto part = static_cast<float>(place - static_cast<double>(below));
  const Colour& low = kHeightColours[below];
  const Colour& high = kHeightColours[below + 1];
  std_msgs::ColorRGBA colour;
  colour.r = low.r + part * (high.r - low.r);
  colour.g = low.g + part * (high.g - low.g);
  colour.b = low.b + part * (high.b - low.b);
  colour.a = 1.0F;
  return colour;
}

/// The colours span the heights of nearly all, so that a few far off do not press them together.
visualization_msgs::Marker landmarkMarker(const TrainingMap& map, const std::string& frame_id) {
  constexpr double kFarOff = 0.02;
  auto marker = emptyMarker(frame_id, "landmarks", 0, visualization_msgs::Marker::POINTS);
  marker.scale.x = marker.scale.y = kLandmarkSize_m;
  for (const LandmarkPoint& landmark : landmarkPoints(map, kMostRead, kMostLandmarks)) {
    marker.points.push_back(tf2::toMsg(landmark.position_m));
  }
  if (marker.points.empty()) return marker;
  std::vector<double> heights_m;
  for (const geometry_msgs::Point& point : marker.points) heights_m.push_back(point.z);
  const double low_m = nearestRank(heights_m, kFarOff);
  const double range_m = std::max(nearestRank(heights_m, 1.0 - kFarOff) - low_m, 1e-3);
  for (const geometry_msgs::Point& point : marker.points) {
    marker.colors.push_back(colourOfHeight((point.z - low_m) / range_m));
  }
  return marker;
}

}  // namespace

Marker toCameraMarker(const Estimate& estimate, const std::optional<CameraModel>& camera,
                      const std_msgs::Header& header) {
  Marker marker;
  marker.header = header;
  marker.ns = "camera";
  marker.type = Marker::LINE_LIST;
  marker.pose.orientation.w = 1.0;
  marker.scale.x = kLine_m;
  marker.color.r = 0.80F;
  marker.color.b = 0.45F;
  marker.color.a = 1.0F;
  if (estimate.metric && camera) addFrustum(marker, estimate.metric->camera, *camera);
  marker.action = marker.points.empty() ? Marker::DELETE : Marker::ADD;
  return marker;
}

void DrivenPath::add(const Estimate& estimate, const std_msgs::Header& header) {
  if (estimate.state != LocalizationState::kTracking || estimate.images_since_metric > 0) return;
  geometry_msgs::PoseStamped pose;
  pose.header = header;
  pose.pose = toPose(estimate, header).pose.pose;
  if (!poses_.empty() && distanceOf(pose.pose.position, poses_.back().pose.position) < kStep_m) return;
  poses_.push_back(pose);
  if (poses_.size() > kMost) poses_.pop_front();
}

nav_msgs::Path DrivenPath::toPath(const std_msgs::Header& header) const {
  nav_msgs::Path path;
  path.header = header;
  path.poses.assign(poses_.begin(), poses_.end());
  return path;
}

nav_msgs::Path toPath(const TrainingMap& map, const std::string& frame_id) {
  nav_msgs::Path path;
  path.header.frame_id = frame_id;
  path.poses.reserve(std::min(map.size(), kMostShown));
  for (std::size_t i = 0; i < map.size(); i += strideFor(map.size(), kMostShown)) {
    geometry_msgs::PoseStamped pose;
    pose.header.frame_id = frame_id;
    pose.pose.position = pointAt(map.position_m(i));
    pose.pose.orientation = quaternionFromYaw(map.yaw_rad(i));
    path.poses.push_back(pose);
  }
  return path;
}

visualization_msgs::MarkerArray toMarkers(const TrainingMap& map, const std::string& frame_id) {
  visualization_msgs::MarkerArray markers;
  markers.markers.push_back(emptyMarker(frame_id, kPositions, 0, visualization_msgs::Marker::SPHERE_LIST));
  markers.markers.back().action = visualization_msgs::Marker::DELETEALL;
  const auto sessions = static_cast<int>(map.header().sessions.size());
  for (int session = 0; session < sessions; ++session) {
    markers.markers.push_back(emptyPositions(session, frame_id));
    markers.markers.push_back(emptyHeadings(session, frame_id));
  }
  for (std::size_t i = 0; i < map.size(); i += strideFor(map.size(), kMostShown)) {
    const TrainingPose image = map.pose(i);
    const auto session = static_cast<std::size_t>(image.session);
    const Eigen::Vector2d direction(std::cos(image.yaw_rad), std::sin(image.yaw_rad));
    markers.markers[2 * session + 1].points.push_back(pointAt(image.position_m));
    auto& heading = markers.markers[2 * session + 2].points;
    heading.push_back(pointAt(image.position_m));
    heading.push_back(pointAt(image.position_m + kHeadingLength_m * direction));
  }
  auto landmarks = landmarkMarker(map, frame_id);
  if (!landmarks.points.empty()) markers.markers.push_back(std::move(landmarks));  // rviz refuses an empty one
  return markers;
}

}  // namespace visual_localization

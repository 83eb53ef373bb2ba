#include "node/markers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include <tf2_eigen/tf2_eigen.h>

#include "base/numbers.h"
#include "node/message_conversions.h"
#include "survey/map_survey.h"

namespace visual_localization {
namespace {

using visualization_msgs::Marker;

constexpr double kRay_m = 6.0;  ///< from the optical centre to a corner
constexpr double kLine_m = 0.2;
constexpr double kRoof = 0.4;  ///< its height, as a share of the image's

/// Upper left, upper right, lower right, lower left; where a lens shows nothing there, of a smaller image.
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
/// A message of a million poses would stop rviz.
constexpr std::size_t kMostShown = 20000;

constexpr std::size_t kMostLandmarks = 200000;
/// Landmarks are read from the map's file, which takes seconds for many more images.
constexpr std::size_t kMostRead = 5000;

struct Colour {
  float r, g, b;
};

/// Readable on white and for colour-blind people (the darker part of viridis).
constexpr std::array<Colour, 4> kHeightColours{
    {{0.27F, 0.00F, 0.33F}, {0.23F, 0.32F, 0.55F}, {0.13F, 0.57F, 0.55F}, {0.37F, 0.79F, 0.38F}}};

/// Okabe and Ito.
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

/// `share` from low to high, clamped.
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

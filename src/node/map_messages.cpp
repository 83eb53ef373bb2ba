#include "node/map_messages.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include <tf2_eigen/tf2_eigen.h>

#include "base/statistics.h"
#include "node/message_conversions.h"
#include "survey/landmark_points.h"

namespace visual_localization {
namespace {

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

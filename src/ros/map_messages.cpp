#include "visual_localization/ros/map_messages.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "visual_localization/ros/message_conversions.h"

namespace visual_localization {
namespace {

constexpr double kPlaceDiameter_m = 0.6;
constexpr double kHeadingLength_m = 1.5;
constexpr double kHeadingWidth_m = 0.12;
/// Of a larger map only every so many-th image is shown: a message of a million poses would stop rviz.
constexpr std::size_t kMostShown = 20000;

std::size_t strideThrough(const TrainingMap& map) { return (map.size() + kMostShown - 1) / kMostShown; }

struct Colour {
  float r, g, b;
};

/// One a session; readable on white and for colour-blind eyes (Okabe and Ito).
constexpr std::array<Colour, 6> kSessionColours{{{0.00F, 0.45F, 0.70F},
                                                 {0.84F, 0.37F, 0.00F},
                                                 {0.00F, 0.62F, 0.45F},
                                                 {0.80F, 0.47F, 0.65F},
                                                 {0.90F, 0.62F, 0.00F},
                                                 {0.34F, 0.71F, 0.91F}}};

geometry_msgs::Point pointAt(const Eigen::Vector2d& position_m) {
  geometry_msgs::Point point;
  point.x = position_m.x();
  point.y = position_m.y();
  return point;
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

visualization_msgs::Marker emptyPlaces(int session, const std::string& frame_id) {
  auto marker = emptyMarker(frame_id, "places", session, visualization_msgs::Marker::SPHERE_LIST);
  marker.scale.x = marker.scale.y = marker.scale.z = kPlaceDiameter_m;
  return marker;
}

visualization_msgs::Marker emptyHeadings(int session, const std::string& frame_id) {
  auto marker = emptyMarker(frame_id, "headings", session, visualization_msgs::Marker::LINE_LIST);
  marker.scale.x = kHeadingWidth_m;
  return marker;
}

}  // namespace

nav_msgs::Path toPath(const TrainingMap& map, const std::string& frame_id) {
  nav_msgs::Path path;
  path.header.frame_id = frame_id;
  path.poses.reserve(std::min(map.size(), kMostShown));
  for (std::size_t i = 0; i < map.size(); i += strideThrough(map)) {
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
  markers.markers.push_back(emptyMarker(frame_id, "places", 0, visualization_msgs::Marker::SPHERE_LIST));
  markers.markers.back().action = visualization_msgs::Marker::DELETEALL;
  const auto sessions = static_cast<int>(map.header().sessions.size());
  for (int session = 0; session < sessions; ++session) {
    markers.markers.push_back(emptyPlaces(session, frame_id));
    markers.markers.push_back(emptyHeadings(session, frame_id));
  }
  for (std::size_t i = 0; i < map.size(); i += strideThrough(map)) {
    const TrainingPlace place = map.place(i);
    const auto session = static_cast<std::size_t>(place.session);
    const Eigen::Vector2d direction(std::cos(place.yaw_rad), std::sin(place.yaw_rad));
    markers.markers[2 * session + 1].points.push_back(pointAt(place.position_m));
    auto& heading = markers.markers[2 * session + 2].points;
    heading.push_back(pointAt(place.position_m));
    heading.push_back(pointAt(place.position_m + kHeadingLength_m * direction));
  }
  return markers;
}

}  // namespace visual_localization

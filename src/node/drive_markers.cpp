#include "node/drive_markers.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <Eigen/Eigenvalues>
#include <tf2_eigen/tf2_eigen.h>

#include "base/numbers.h"
#include "base/text.h"
#include "node/drawings.h"
#include "node/message_conversions.h"

namespace visual_localization {
namespace {

using visualization_msgs::Marker;

constexpr double kStep_m = 0.2;
constexpr std::size_t kMost = 5000;
constexpr double kSigmas = 3.0;

std_msgs::ColorRGBA driveColour(LocalizationState state) {
  const cv::Scalar bgr = colourOfState(static_cast<std::uint8_t>(state));
  std_msgs::ColorRGBA colour;
  colour.r = static_cast<float>(bgr[2] / 255.0);
  colour.g = static_cast<float>(bgr[1] / 255.0);
  colour.b = static_cast<float>(bgr[0] / 255.0);
  colour.a = 1.0F;
  return colour;
}

Marker driveMarker(const std_msgs::Header& header, const char* name, int type, LocalizationState state) {
  Marker marker;
  marker.header = header;
  marker.ns = name;
  marker.type = type;
  marker.action = Marker::ADD;
  marker.pose.orientation.w = 1.0;
  marker.color = driveColour(state);
  return marker;
}

geometry_msgs::Point pointAbove(const Eigen::Vector2d& position_m, double height_m) {
  return tf2::toMsg(Eigen::Vector3d(position_m.x(), position_m.y(), height_m));
}

Marker robot(const Estimate& estimate, const std_msgs::Header& header) {
  Marker marker = driveMarker(header, "robot", Marker::ARROW, estimate.state);
  marker.pose.position = pointAbove(estimate.pose.position_m, 0.5);
  marker.pose.orientation = quaternionFromYaw(estimate.pose.yaw_rad);
  marker.scale.x = 3.5;
  marker.scale.y = marker.scale.z = 1.0;
  return marker;
}

Marker outline(const Estimate& estimate, const std_msgs::Header& header) {
  constexpr int kCorners = 48;
  Marker marker = driveMarker(header, "three sigma", Marker::LINE_STRIP, estimate.state);
  marker.scale.x = 0.25;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(estimate.pose.covariance_m2);
  const Eigen::Matrix2d to_edge =
      kSigmas * axes.eigenvectors() * axes.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
  for (int i = 0; i <= kCorners; ++i) {
    const double angle_rad = 2.0 * kPi * i / kCorners;
    const Eigen::Vector2d edge_m = to_edge * Eigen::Vector2d(std::cos(angle_rad), std::sin(angle_rad));
    marker.points.push_back(pointAbove(estimate.pose.position_m + edge_m, 0.3));
  }
  return marker;
}

Marker words(const Estimate& estimate, const std_msgs::Header& header) {
  constexpr std::size_t kLine = 40;  // characters
  Marker marker = driveMarker(header, "reason", Marker::TEXT_VIEW_FACING, estimate.state);
  marker.pose.position = pointAbove(estimate.pose.position_m, 6.0);
  marker.scale.z = 1.5;
  marker.text = toString(estimate.state) + '\n' + joined(inLines(describe(estimate.why), kLine), "\n");
  return marker;
}

}  // namespace

void DriveMarkers::add(const Estimate& estimate) {
  last_ = estimate;
  const Passed here{estimate.pose.position_m, estimate.state};
  const bool moved =
      way_.empty() || way_.back().state != here.state || (way_.back().position_m - here.position_m).norm() >= kStep_m;
  if (moved) way_.push_back(here);
  if (way_.size() > kMost) way_.pop_front();
}

void DriveMarkers::stateIs(LocalizationState state, const Why& why) {
  if (!last_) return;
  last_->state = state;
  last_->why = why;
}

visualization_msgs::MarkerArray DriveMarkers::toMarkers(const std_msgs::Header& header) const {
  visualization_msgs::MarkerArray markers;
  if (!last_) return markers;
  Marker confirmed = driveMarker(header, "confirmed way", Marker::LINE_LIST, LocalizationState::kTracking);
  Marker doubtful = driveMarker(header, "doubtful way", Marker::LINE_LIST, LocalizationState::kUncertain);
  confirmed.scale.x = 0.5;
  doubtful.scale.x = 0.15;
  for (std::size_t i = 1; i < way_.size(); ++i) {
    const Passed& from = way_[i - 1];
    const Passed& to = way_[i];
    if ((to.position_m - from.position_m).norm() > kJump_m) continue;
    const LocalizationState state = from.state == LocalizationState::kTracking ? to.state : from.state;
    Marker& way = state == LocalizationState::kTracking ? confirmed : doubtful;
    for (const Passed* end : {&from, &to}) {
      way.points.push_back(pointAbove(end->position_m, 0.1));
      way.colors.push_back(driveColour(state));
    }
  }
  for (Marker* way : {&confirmed, &doubtful}) {
    if (way->points.empty()) way->action = Marker::DELETE;  // rviz refuses an empty one
    markers.markers.push_back(*way);
  }
  markers.markers.push_back(robot(*last_, header));
  markers.markers.push_back(outline(*last_, header));
  markers.markers.push_back(words(*last_, header));
  return markers;
}

}  // namespace visual_localization

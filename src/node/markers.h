#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <string>

#include <geometry_msgs/PoseStamped.h>
#include <nav_msgs/Path.h>
#include <std_msgs/Header.h>
#include <visualization_msgs/Marker.h>
#include <visualization_msgs/MarkerArray.h>

#include "visual_localization/camera/camera_model.h"
#include "visual_localization/localization/estimate.h"
#include "visual_localization/map/training_map.h"

/// What rviz shows of map and drive.
namespace visual_localization {

/// Lines along the corners of the field of view, and a roof over the upper edge. Takes the one before away when the
/// pose is not metric. `header`: map frame.
visualization_msgs::Marker toCameraMarker(const Estimate& estimate, const std::optional<CameraModel>& camera,
                                          const std_msgs::Header& header);

/// Where the robot drove, as far as it was tracked. Not thread-safe.
class DrivenPath {
 public:
  static constexpr std::size_t kMost = 5000;
  static constexpr double kStep_m = 0.2;

  /// Keeps poses of the state TRACKING only; where landmarks are used, metric ones. `header`: map frame, stamp of the
  /// image.
  void add(const Estimate& estimate, const std_msgs::Header& header);
  void clear() { poses_.clear(); }
  nav_msgs::Path toPath(const std_msgs::Header& header) const;

 private:
  std::deque<geometry_msgs::PoseStamped> poses_;  ///< oldest first
};

/// Image by image, session by session. Of more than 20000 images only every k-th: here and in the markers.
nav_msgs::Path toPath(const TrainingMap& map, const std::string& frame_id);

/// Positions and headings of the training images, per session, and each landmark once as a point coloured by height: of
/// at most 5000 images and 200000 points, evenly chosen. Begins with a marker that deletes those of an earlier map.
visualization_msgs::MarkerArray toMarkers(const TrainingMap& map, const std::string& frame_id);

}  // namespace visual_localization

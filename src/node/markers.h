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

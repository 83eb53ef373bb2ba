#pragma once

#include <optional>
#include <string>
#include <vector>

#include <diagnostic_updater/DiagnosticStatusWrapper.h>
#include <visualization_msgs/Marker.h>

#include "node/recording_watch.h"
#include "node/session_bag.h"
#include "visual_localization/camera/camera_model.h"

namespace visual_localization {

/// What the recorder knows of its streams.
struct RecordingStatus {
  double image_rate_hz = 0.0;
  std::string no_images;            ///< where none come, and why that may be
  std::string image_trouble;        ///< of the last image
  std::string calibration_trouble;  ///< that no later message mends
  std::optional<CameraModel> camera;
};

void reportRecording(const RecordingStatus& recording, const SessionBag& bag, const std::string& folder,
                     diagnostic_updater::DiagnosticStatusWrapper& status);
/// `mount_trouble`: why the map will not know the mounting; empty when it will.
void reportSession(const RecordingWatch::Summary& seen, bool extends_map, const std::string& mount_trouble,
                   diagnostic_updater::DiagnosticStatusWrapper& status);
/// The way so far, coloured by weakness.
visualization_msgs::Marker wayMarker(const std::vector<RecordingWatch::Spot>& spots, const std::string& frame_id);

}  // namespace visual_localization

#include "node/recorder_report.h"

#include <filesystem>
#include <system_error>

#include <geometry_msgs/Point.h>

namespace visual_localization {
namespace {

using diagnostic_msgs::DiagnosticStatus;

constexpr std::size_t kMostSpots = 20000;  ///< of a longer way every k-th is shown

std_msgs::ColorRGBA colourOf(Weakness weakness) {
  std_msgs::ColorRGBA colour;
  colour.a = 1.0F;
  colour.r = weakness == Weakness::kNone ? 0.0F : weakness == Weakness::kNoFix ? 0.84F : 0.90F;
  colour.g = weakness == Weakness::kNone ? 0.62F : weakness == Weakness::kNoFix ? 0.10F : 0.62F;
  colour.b = weakness == Weakness::kNone ? 0.45F : 0.0F;
  return colour;
}

}  // namespace

visualization_msgs::Marker wayMarker(const std::vector<RecordingWatch::Spot>& spots, const std::string& frame_id) {
  visualization_msgs::Marker line;
  const std::size_t step = 1 + spots.size() / kMostSpots;
  for (std::size_t i = 0; i < spots.size(); i += step) {
    geometry_msgs::Point point;
    point.x = spots[i].position_m.x();
    point.y = spots[i].position_m.y();
    line.points.push_back(point);
    line.colors.push_back(colourOf(spots[i].weakness));
  }
  line.header.frame_id = frame_id;
  line.header.stamp = ros::Time::now();
  line.ns = "way";
  line.type = visualization_msgs::Marker::LINE_STRIP;
  line.action = visualization_msgs::Marker::ADD;
  line.pose.orientation.w = 1.0;
  line.scale.x = 0.4;
  return line;
}

void reportRecording(const RecordingStatus& recording, const SessionBag& bag, const std::string& folder,
                     diagnostic_updater::DiagnosticStatusWrapper& status) {
  if (!bag.trouble().empty()) {
    status.summary(DiagnosticStatus::ERROR, "Nothing is recorded: " + bag.trouble());
  } else if (recording.image_rate_hz == 0.0) {
    status.summary(DiagnosticStatus::ERROR, "No images on " + recording.no_images);
  } else if (!recording.image_trouble.empty()) {
    status.summary(DiagnosticStatus::WARN, "Unusable image: " + recording.image_trouble);
  } else if (!recording.calibration_trouble.empty()) {
    status.summary(DiagnosticStatus::WARN, "No map can be made: " + recording.calibration_trouble);
  } else if (bag.lost() > 0) {
    status.summary(DiagnosticStatus::WARN,
                   std::to_string(bag.lost()) + " messages lost so far: more came than could be kept");
  } else {
    status.summary(DiagnosticStatus::OK, "Recording");
  }
  status.add("Bag", bag.path());
  status.addf("Size (MB)", "%.1f", static_cast<double>(bag.size()) * 1e-6);
  std::error_code none;
  const auto space = std::filesystem::space(folder, none);
  if (!none) status.addf("Free (MB)", "%.0f", static_cast<double>(space.available) * 1e-6);
  status.add("Messages", bag.recorded());
  status.add("Messages lost", bag.lost());
  status.add("Camera", recording.camera ? describe(*recording.camera) : "not calibrated: a map of places");
  status.addf("Images (Hz)", "%.2f", recording.image_rate_hz);
}

void reportSession(const RecordingWatch::Summary& seen, bool extends_map, const std::string& mount_trouble,
                   diagnostic_updater::DiagnosticStatusWrapper& status) {
  constexpr double kMostlyKnown = 0.5;
  if (seen.images == 0) {
    status.summary(DiagnosticStatus::WARN, "No image yet");
  } else if (seen.now != Weakness::kNone) {
    status.summary(DiagnosticStatus::WARN, std::string("Weak here: ") + describe(seen.now));
  } else if (seen.known_way_share > kMostlyKnown) {
    status.summary(DiagnosticStatus::OK, "The map has this way at this time of day: another hour would add more");
  } else {
    status.summary(DiagnosticStatus::OK, "Good");
  }
  status.add("Images looked at", seen.images);
  for (std::size_t i = 1; i < kWeaknesses; ++i) {
    status.add(std::string("Weak: ") + describe(static_cast<Weakness>(i)), seen.weak[i]);
  }
  status.addf("Fixes, usable", "%zu, %zu", seen.fixes, seen.usable_fixes);
  status.addf("Sigma of the fix (m)", "%.2f", seen.fix_sigma_m);
  status.addf("Way (m)", "%.0f", seen.way_m);
  status.addf("Spacing (m)", "%.2f", seen.spacing_m);
  status.add("Features", seen.features);
  if (extends_map) status.addf("Way that the map has (%)", "%.0f", 100.0 * seen.known_way_share);
  if (!mount_trouble.empty()) status.mergeSummary(DiagnosticStatus::WARN, "Mounting not known: " + mount_trouble);
}

}  // namespace visual_localization

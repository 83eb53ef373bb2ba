// What the recorder shows: diagnostics, and the way in rviz.
#include <filesystem>
#include <system_error>

#include <geometry_msgs/Point.h>
#include <visualization_msgs/Marker.h>

#include "node/map_recorder.h"

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

/// A line along the images, coloured by what is weak there.
void MapRecorder::publishWay() {
  visualization_msgs::Marker line;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::vector<RecordingWatch::Spot>& spots = watch_->spots();
    if (spots.size() == published_ || spots.size() < 2) return;
    published_ = spots.size();
    const std::size_t step = 1 + spots.size() / kMostSpots;
    for (std::size_t i = 0; i < spots.size(); i += step) {
      geometry_msgs::Point point;
      point.x = spots[i].position_m.x();
      point.y = spots[i].position_m.y();
      line.points.push_back(point);
      line.colors.push_back(colourOf(spots[i].weakness));
    }
  }
  line.header.frame_id = config_.global_frame_id;
  line.header.stamp = ros::Time::now();
  line.ns = "way";
  line.type = visualization_msgs::Marker::LINE_STRIP;
  line.action = visualization_msgs::Marker::ADD;
  line.pose.orientation.w = 1.0;
  line.scale.x = 0.4;
  way_.publish(line);
}

void MapRecorder::reportRecording(Wrapper& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!disk_trouble_.empty()) {
    status.summary(DiagnosticStatus::ERROR, "Nothing is recorded: " + disk_trouble_);
  } else if (images_.rate_hz() == 0.0) {
    status.summary(DiagnosticStatus::ERROR, "No images on " + image_topic_);
  } else if (!image_trouble_.empty()) {
    status.summary(DiagnosticStatus::WARN, "Unusable image: " + image_trouble_);
  } else if (lost_ > 0) {
    status.summary(DiagnosticStatus::WARN,
                   std::to_string(lost_) + " messages lost so far: more came than could be kept");
  } else {
    status.summary(DiagnosticStatus::OK, "Recording");
  }
  status.add("Bag", bag_->path());
  status.addf("Size (MB)", "%.1f", static_cast<double>(bag_->size()) * 1e-6);
  std::error_code none;
  const auto space = std::filesystem::space(config_.folder, none);
  if (!none) status.addf("Free (MB)", "%.0f", static_cast<double>(space.available) * 1e-6);
  status.add("Messages", recorded_);
  status.add("Messages lost", lost_);
  status.addf("Images (Hz)", "%.2f", images_.rate_hz());
}

void MapRecorder::reportSession(Wrapper& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const RecordingWatch::Summary seen = watch_->summary();
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
  if (!config_.map.empty()) status.addf("Way that the map has (%)", "%.0f", 100.0 * seen.known_way_share);
}

}  // namespace visual_localization

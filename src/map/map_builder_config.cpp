#include "visual_localization/features/sift_extractor.h"
#include "visual_localization/geometry/sensor_mount.h"
#include "visual_localization/map/map_builder.h"

namespace visual_localization {
namespace {

template <class Parse>
bool canParse(const std::string& text, Parse parse) {
  try {
    if (!text.empty()) parse(text);
    return true;
  } catch (const MountError&) {
    return false;
  }
}

void requireMountTexts(ParameterVisitor& visitor, const std::string& camera, const std::string& antenna) {
  visitor.require(canParse(camera, parseCameraMount), "robot/camera", "'" + camera + "'",
                  "six numbers: x y z yaw pitch roll, metres (at most 100) and radians");
  visitor.require(canParse(antenna, parseAntennaMount), "robot/antenna", "'" + antenna + "'",
                  "three numbers: x y z, metres, at most 100");
}

}  // namespace

void MapBuilderConfig::declare(ParameterVisitor& visitor) {
  visitor.real({"map/min_spacing", "m", "skip an image closer than this to the last kept one of its session"},
               min_spacing_m, 0.0, 1000.0);
  visitor.real(
      {"map/spacing", "m",
       "keep, after all images were pruned and adjusted, only those at least this far from the last kept one of their "
       "session"},
      spacing_m, 0.0, 1000.0);
  visitor.flag(
      {"map/prune", "", "keep only features that one of the two nearest training images of its session shows too"},
      prune);
  visitor.integer({"map/preview_width", "px", "width of the stored previews; 0 stores none"}, preview_width_px, 0, 640);
  visitor.choice(
      {"map/sift_backend", "", "extractor of SIFT features: our own, or OpenCV's; either serves any localizer"},
      sift_backend, siftBackends());
  visitor.text({"robot/base_frame", "", "frame of the robot in /tf_static"}, base_frame);
  visitor.text({"robot/camera", "m, rad",
                "x y z yaw pitch roll of the camera (x ahead) on the robot; empty: from /tf_static, or the robot is "
                "where the camera is"},
               camera_mount);
  visitor.text({"robot/antenna", "m", "x y z of the antenna on the robot; empty: likewise"}, antenna_mount);
  requireMountTexts(visitor, camera_mount, antenna_mount);
  sift.declare(visitor);
  match.declare(visitor);
  trajectory.declare(visitor);
  geometry.declare(visitor);
}

}  // namespace visual_localization

#include "node/camera_marker.h"

#include <array>

#include <tf2_eigen/tf2_eigen.h>

namespace visual_localization {
namespace {

using visualization_msgs::Marker;

constexpr double kRay_m = 6.0;  ///< from the optical centre to a corner
constexpr double kLine_m = 0.2;
constexpr double kRoof = 0.4;  ///< its height, as a share of the image's

/// Of the corners of the image: upper left, upper right, lower right, lower left. Where a lens shows nothing there, of
/// a smaller image.
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

}  // namespace visual_localization

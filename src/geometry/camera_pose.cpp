#include "visual_localization/geometry/camera_pose.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <locale>
#include <sstream>
#include <vector>

#include "base/numbers.h"

namespace visual_localization {
namespace {

constexpr double kFarthest_m = 100.0;
constexpr double kUnitTolerance = 1e-3;

std::vector<double> numbersOf(const std::string& text, std::size_t count, const char* meaning) {
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  std::vector<double> numbers;
  for (double number = 0.0; in >> number;) numbers.push_back(number);
  if (!in.eof() || numbers.size() != count) {
    throw MountError("'" + text + "' must be " + std::to_string(count) + " numbers: " + meaning);
  }
  return numbers;
}

void requireNear(const char* what, const Eigen::Vector3d& position_m) {
  if (position_m.norm() <= kFarthest_m) return;
  throw MountError(std::string(what) + " must be at most 100 m from the robot's origin");
}

}  // namespace

Eigen::Isometry3d SensorMount::baseInMap(const CameraPose& camera_in_map) const {
  Eigen::Isometry3d base = Eigen::Isometry3d::Identity();
  base.linear() = (camera_in_map.rotation * camera.rotation.conjugate()).normalized().toRotationMatrix();
  base.translation() = camera_in_map.position_m - base.linear() * camera.position_m;
  return base;
}

double yawOf(const Eigen::Isometry3d& base_in_map) {
  return std::atan2(base_in_map.linear()(1, 0), base_in_map.linear()(0, 0));
}

void requireMount(const SensorMount& mount) {
  requireNear("the camera", mount.camera.position_m);
  requireNear("the antenna", mount.antenna_m);
  if (!(std::abs(mount.camera.rotation.norm() - 1.0) <= kUnitTolerance)) {
    throw MountError("the camera's rotation is not of unit length");
  }
}

CameraPose parseCameraMount(const std::string& text) {
  const std::vector<double> n =
      numbersOf(text, 6, "x y z yaw pitch roll of the camera on the robot, metres and radians");
  for (const double angle : {n[3], n[4], n[5]}) {
    if (std::abs(angle) <= 2.0 * kPi) continue;
    throw MountError("'" + text + "': an angle is beyond 2 pi: yaw, pitch and roll are radians, not degrees");
  }
  const Eigen::Quaterniond body(Eigen::AngleAxisd(n[3], Eigen::Vector3d::UnitZ()) *
                                Eigen::AngleAxisd(n[4], Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(n[5], Eigen::Vector3d::UnitX()));
  SensorMount mount;
  mount.camera = {body * levelCamera(0.0), {n[0], n[1], n[2]}};
  requireMount(mount);
  return mount.camera;
}

Eigen::Vector3d parseAntennaMount(const std::string& text) {
  const std::vector<double> n = numbersOf(text, 3, "x y z of the antenna on the robot, metres");
  SensorMount mount;
  mount.antenna_m = {n[0], n[1], n[2]};
  requireMount(mount);
  return mount.antenna_m;
}

std::string describe(const SensorMount& mount) {
  constexpr double kLevel_deg = 0.5;
  const Eigen::Vector3d ahead = mount.camera.ahead();
  const Eigen::IOFormat row(Eigen::StreamPrecision, Eigen::DontAlignCols);
  const Eigen::Vector3d level = ahead.cross(Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d right = mount.camera.rotation * Eigen::Vector3d::UnitX();
  const double roll_deg = toDegrees(std::atan2(-right.dot(level.cross(ahead)), right.dot(level)));
  std::ostringstream rolled;
  rolled.imbue(std::locale::classic());
  rolled << std::fixed << std::setprecision(1) << roll_deg;
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << std::fixed << std::setprecision(2) << "camera at " << mount.camera.position_m.transpose().format(row)
      << " m, looking " << std::setprecision(1) << toDegrees(std::atan2(ahead.y(), ahead.x()))
      << " degrees to the left and " << toDegrees(std::asin(std::clamp(ahead.z(), -1.0, 1.0))) << " up"
      << (std::abs(roll_deg) < kLevel_deg ? "" : ", rolled by " + rolled.str() + " clockwise") << "; antenna at "
      << std::setprecision(2) << mount.antenna_m.transpose().format(row) << " m";
  return out.str();
}

}  // namespace visual_localization

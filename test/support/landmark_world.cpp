#include "test/support/landmark_world.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include <Eigen/Geometry>

#include "base/numbers.h"
#include "visual_localization/geo/trajectory_cleaner.h"

namespace visual_localization::test {
namespace {

constexpr double kSight_m = 25.0;
constexpr int kFixesPerImage = 5;
constexpr std::int64_t kFixInterval_ns = 200'000'000;

/// From 0 to 1 while `x` does so, without a jump of the slope.
double smoothStep(double x) {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

Eigen::Quaterniond turned(double angle_rad, const Eigen::Vector3d& axis) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, axis));
}

Eigen::Vector2d between(const std::vector<DrivenPose>& poses, std::size_t i, double share) {
  const Eigen::Vector2d here = poses[i].camera.position_m.head<2>();
  return here + share * (poses[i + 1].camera.position_m.head<2>() - here);
}

std::vector<MapFix> fixesOf(const std::vector<DrivenPose>& poses, double noise_m, std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, 1.0);
  std::vector<MapFix> fixes;
  for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
    for (int k = 0; k < kFixesPerImage; ++k) {
      const double east_m = noise_m * noise(random);
      const Eigen::Vector2d off(east_m, noise_m * noise(random));
      fixes.push_back({static_cast<std::int64_t>(fixes.size()) * kFixInterval_ns,
                       between(poses, i, static_cast<double>(k) / kFixesPerImage) + off});
    }
  }
  const std::int64_t end_ns = static_cast<std::int64_t>(fixes.size()) * kFixInterval_ns;
  if (!poses.empty()) fixes.push_back({end_ns, poses.back().camera.position_m.head<2>()});
  return fixes;
}

}  // namespace

CameraModel streetCamera() {
  return CameraModel({{640, 480}, 450.0, 450.0, 319.5, 239.5, Distortion::kPlumbBob, {-0.1, 0.01, 0.0, 0.0, 0.0}});
}

WorldPoint randomPoint(const Eigen::Vector3d& position_m, std::mt19937& random) {
  std::uniform_int_distribution<int> byte(0, 255);
  WorldPoint point;
  point.position_m = position_m;
  for (auto& value : point.descriptor) value = static_cast<std::uint8_t>(byte(random));
  return point;
}

namespace {

/// Points of a world by squares of the map as wide as one can see. Those that move are in none.
class PointGrid {
 public:
  explicit PointGrid(const std::vector<WorldPoint>& world) {
    for (std::size_t i = 0; i < world.size(); ++i) {
      (world[i].motion_m.isZero(0.0) ? cells_[cellOf(world[i].position_m)] : moving_).push_back(i);
    }
  }

  /// In their order, all that may be seen from a position.
  std::vector<std::size_t> around(const Eigen::Vector3d& position_m) const {
    std::vector<std::size_t> near = moving_;
    const auto [x, y] = cellOf(position_m);
    for (long i = x - 1; i <= x + 1; ++i) {
      for (long j = y - 1; j <= y + 1; ++j) {
        const auto cell = cells_.find({i, j});
        if (cell != cells_.end()) near.insert(near.end(), cell->second.begin(), cell->second.end());
      }
    }
    std::sort(near.begin(), near.end());
    return near;
  }

 private:
  using Cell = std::pair<long, long>;

  static Cell cellOf(const Eigen::Vector3d& position_m) {
    return {std::lround(std::floor(position_m.x() / kSight_m)), std::lround(std::floor(position_m.y() / kSight_m))};
  }

  std::map<Cell, std::vector<std::size_t>> cells_;
  std::vector<std::size_t> moving_;
};

View viewOf(const std::vector<WorldPoint>& world, const std::vector<std::size_t>& points, const CameraModel& camera,
            const CameraPose& pose, double noise_px, std::mt19937& random, std::size_t image) {
  std::normal_distribution<double> noise(0.0, 1.0);
  std::vector<Keypoint> keypoints;
  std::vector<std::uint8_t> descriptors;
  View view;
  for (const std::size_t i : points) {
    const Eigen::Vector3d position_m = world[i].position_m + static_cast<double>(image) * world[i].motion_m;
    const Eigen::Vector3d point = pose.toCamera(position_m);
    if (point.z() < 1.0 || point.norm() > kSight_m) continue;
    const Eigen::Vector2d pixel = camera.project(point);
    if (!(pixel.x() > 0.0 && pixel.x() < camera.size().width - 1 && pixel.y() > 0.0 &&
          pixel.y() < camera.size().height - 1)) {
      continue;
    }
    const double x_px = pixel.x() + noise_px * noise(random);
    const double y_px = pixel.y() + noise_px * noise(random);
    keypoints.push_back({static_cast<float>(x_px), static_cast<float>(y_px), 0.0F, 0.0F});
    descriptors.insert(descriptors.end(), world[i].descriptor.begin(), world[i].descriptor.end());
    view.points.push_back(i);
  }
  view.features = LocalFeatures(std::move(keypoints), std::move(descriptors));
  return view;
}

}  // namespace

View viewOf(const std::vector<WorldPoint>& world, const CameraModel& camera, const CameraPose& pose, double noise_px,
            std::mt19937& random, std::size_t image) {
  std::vector<std::size_t> all(world.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return viewOf(world, all, camera, pose, noise_px, random, image);
}

Eigen::Quaterniond mountingOf(const StreetDrive& street) {
  return Eigen::Quaterniond(turned(street.yaw_rad, Eigen::Vector3d::UnitY()) *
                            turned(street.pitch_rad, Eigen::Vector3d::UnitX()) *
                            turned(street.roll_rad, Eigen::Vector3d::UnitZ()));
}

std::vector<DrivenPose> drive(const StreetDrive& street) {
  std::vector<DrivenPose> poses;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  const auto count = static_cast<double>(street.images);
  for (std::size_t i = 0; i < street.images; ++i) {
    const double share = static_cast<double>(i) / count;
    const double yaw_rad = street.turn_rad * (smoothStep((share - 0.2) / 0.25) - smoothStep((share - 0.55) / 0.25));
    const double slope = share > 1.0 / 3.0 && share < 2.0 / 3.0 ? street.slope : 0.0;
    DrivenPose pose;
    pose.travel_yaw_rad = yaw_rad;
    pose.camera.position_m = position_m;
    pose.camera.rotation =
        levelCamera(yaw_rad) * turned(std::atan(slope), Eigen::Vector3d::UnitX()) * mountingOf(street);
    poses.push_back(pose);
    const double way_m = street.reverses && share > 0.8 ? -street.spacing_m : street.spacing_m;
    position_m += way_m * Eigen::Vector3d(std::cos(yaw_rad), std::sin(yaw_rad), slope);
  }
  return poses;
}

std::vector<WorldPoint> pointsAlong(const std::vector<DrivenPose>& poses, double points_per_m, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<WorldPoint> world;
  const auto add = [&](const DrivenPose& pose, double ahead_m) {
    const double beside_m = (unit(random) < 0.5 ? -1.0 : 1.0) * (2.0 + 8.0 * unit(random));
    const double up_m = -1.5 + 7.0 * unit(random);
    const Eigen::Vector3d in_camera(beside_m, -up_m, ahead_m);
    world.push_back(randomPoint(pose.camera.position_m + levelCamera(pose.travel_yaw_rad) * in_camera, random));
  };
  const auto per_pose = static_cast<int>(std::lround(points_per_m));
  for (const DrivenPose& pose : poses) {
    for (int k = 0; k < per_pose; ++k) add(pose, unit(random));
  }
  for (int k = 0; k < 20 * per_pose; ++k) add(poses.back(), 20.0 * unit(random));
  return world;
}

UnadjustedSession RecordedDrive::unadjusted() const {
  UnadjustedSession session;
  session.camera = &camera;
  session.fixes = fixes;
  session.features = [this](std::size_t i) { return views[i]; };
  const LocalFrame frame({48.5, 9.05, 430.0});
  std::vector<Fix> raw;
  for (const MapFix& fix : fixes) raw.push_back({fix.stamp_ns, frame.toGeodetic(fix.position_m), true});
  const CleanedTrajectory cleaned = cleanTrajectory(raw, frame, {});
  const Trajectory& path = cleaned.trajectory;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    session.fixes[i].believed = cleaned.verdicts[i] == FixVerdict::kKept;
  }
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::int64_t stamp_ns = static_cast<std::int64_t>(i) * kFixesPerImage * kFixInterval_ns;
    const std::int64_t known_ns = std::clamp(stamp_ns, path.points().front().stamp_ns, path.points().back().stamp_ns);
    session.images.push_back(*path.at(known_ns));
    session.images.back().stamp_ns = stamp_ns;
  }
  return session;
}

RecordedDrive record(const std::vector<DrivenPose>& poses, const std::vector<WorldPoint>& world, double fix_noise_m,
                     std::mt19937& random, const CameraModel& camera) {
  RecordedDrive recorded;
  recorded.camera = camera;
  recorded.truth = poses;
  recorded.fixes = fixesOf(poses, fix_noise_m, random);
  const PointGrid grid(world);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::vector<std::size_t> points = grid.around(poses[i].camera.position_m);
    const View view = viewOf(world, points, recorded.camera, poses[i].camera, kKeypointSigma_px, random, i);
    recorded.views.push_back(std::make_shared<const LocalFeatures>(view.features));
  }
  return recorded;
}

std::shared_ptr<const TrainingMap> mapOf(const RecordedDrive& drive) {
  const UnadjustedSession session = drive.unadjusted();
  SessionGeometry geometry = adjustSessions({session}, {}, 1).front();
  std::vector<TrainingImage> images(drive.views.size());
  for (std::size_t i = 0; i < images.size(); ++i) {
    images[i].stamp_ns = session.images[i].stamp_ns;
    images[i].local = *drive.views[i];
    images[i].geometry = std::move(geometry.images[i]);
    images[i].position_m = images[i].geometry->camera.position_m.head<2>();
    images[i].yaw_rad = images[i].geometry->camera.yaw_rad();
  }
  MapHeader header;
  header.datum = {48.5, 9.0, 400.0};
  header.image_size = drive.camera.size();
  header.sessions = {{"street", drive.camera}};
  return std::make_shared<const TrainingMap>(header, std::move(images));
}

void bendFixes(RecordedDrive& drive, double begin, double end, double most_m) {
  const auto count = static_cast<double>(drive.fixes.size());
  for (std::size_t i = 0; i < drive.fixes.size(); ++i) {
    const double share = (static_cast<double>(i) / count - begin) / (end - begin);
    if (share <= 0.0 || share >= 1.0) continue;
    drive.fixes[i].position_m += most_m * std::sin(kPi * share) * Eigen::Vector2d(0.6, -0.8);
  }
}

double pathError_m(const std::vector<Eigen::Vector2d>& positions_m, const std::vector<DrivenPose>& truth) {
  double sum = 0.0;
  for (std::size_t i = 0; i < positions_m.size(); ++i) {
    sum += (positions_m[i] - truth[i].camera.position_m.head<2>()).squaredNorm();
  }
  return positions_m.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(positions_m.size()));
}

}  // namespace visual_localization::test

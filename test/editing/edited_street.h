#pragma once

#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "test/support/landmark_world.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization::test {

/// Drives along one street, each made into a map on its own.
class EditedStreet {
 public:
  EditedStreet() {
    std::mt19937 random(41);
    world_ = pointsAlong(drive({}), 12.0, random);
  }

  /// Of images [begin, end) of a drive whose fixes are all off by `bias_m`.
  std::shared_ptr<const TrainingMap> mapOfDay(int day, const Eigen::Vector2d& bias_m, std::size_t begin = 0,
                                              std::size_t end = 45) const {
    std::mt19937 random(static_cast<std::uint32_t>(100 + day));
    auto poses = drive({});
    for (DrivenPose& pose : poses)
      pose.camera.position_m += pose.camera.rotation * Eigen::Vector3d(0.2 * day, 0.0, 0.0);
    RecordedDrive recorded = record(poses, world_, 0.05, random);
    for (MapFix& fix : recorded.fixes) fix.position_m += bias_m;
    const auto whole = mapOf(recorded);
    std::vector<TrainingImage> images;
    for (std::size_t i = begin; i < end; ++i) {
      images.push_back(whole->image(i));
      images.back().stamp_ns += day * kDay_ns;
    }
    MapHeader header = whole->header();
    header.sessions.front().name = "day" + std::to_string(day);
    return std::make_shared<const TrainingMap>(std::move(header), std::move(images));
  }

  static Eigen::Vector3d truth_m(int day, std::size_t image) {
    const DrivenPose pose = drive({})[image];
    return pose.camera.position_m + pose.camera.rotation * Eigen::Vector3d(0.2 * day, 0.0, 0.0);
  }

  static constexpr std::int64_t kDay_ns = 86'400'000'000'000;

 private:
  std::vector<WorldPoint> world_;
};

}  // namespace visual_localization::test

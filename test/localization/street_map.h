#pragma once

#include <cstddef>
#include <memory>
#include <random>
#include <vector>

#include "test/support/fake_image.h"
#include "test/support/landmark_world.h"
#include "visual_localization/localization/similarity.h"

namespace visual_localization::test {

constexpr std::size_t kFew = 15;  ///< matches: between the default of 12 near a prediction and that of 20 elsewhere

/// A map of a street, its landmarks found by the adjustment of a drive.
class StreetMap {
 public:
  const TrainingMap& map() const { return *map_; }
  const CameraModel& camera() const { return camera_; }

  /// A place beside that of training image `i`: `by_m` in its camera's frame.
  CameraPose trueNear(std::size_t i, const Eigen::Vector3d& by_m) const { return moved(poses_[i].camera, by_m); }
  /// The same place where the map has it, which is not quite the truth: nobody can know better.
  CameraPose mappedNear(std::size_t i, const Eigen::Vector3d& by_m) const {
    return moved(map_->geometry(i)->camera, by_m);
  }
  LocalFeatures seenFrom(const CameraPose& pose) {
    return viewOf(world_, camera_, pose, kKeypointSigma_px, random_).features;
  }
  /// Where each landmark stands `sigma_m` along each axis from where it stood on the day of the map.
  LocalFeatures seenInWind(const CameraPose& pose, double sigma_m) {
    std::normal_distribution<double> normal(0.0, 1.0);
    std::vector<WorldPoint> blown = world_;
    for (WorldPoint& point : blown) {
      for (Eigen::Index axis = 0; axis < 3; ++axis) point.position_m[axis] += sigma_m * normal(random_);
    }
    return viewOf(blown, camera_, pose, kKeypointSigma_px, random_).features;
  }
  /// Only the first few features that show landmarks of training image `i`.
  LocalFeatures fewSeenFrom(const CameraPose& pose, std::size_t i, std::size_t count = kFew) {
    return fewOf(seenFrom(pose), i, count);
  }
  LocalFeatures fewOf(const LocalFeatures& all, std::size_t i, std::size_t count = kFew) const {
    std::vector<std::size_t> landmarks;
    for (const SeenLandmark& landmark : map_->geometry(i)->landmarks) landmarks.push_back(landmark.feature);
    std::vector<std::size_t> chosen;
    for (const FeatureMatch& match : matchSymmetric(all, map_->local(i)->subset(landmarks), 0.5)) {
      if (chosen.size() < count) chosen.push_back(match.a);
    }
    return all.subset(chosen);
  }

 private:
  static CameraPose moved(const CameraPose& pose, const Eigen::Vector3d& by_m) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitY()));
    return {pose.rotation * turn, pose.position_m + pose.rotation * by_m};
  }

  CameraModel camera_ = streetCamera();
  std::mt19937 random_{1};
  std::vector<DrivenPose> poses_ = drive({});
  std::vector<WorldPoint> world_ = pointsAlong(poses_, 6.0, random_);
  std::shared_ptr<const TrainingMap> map_ = mapOf(record(poses_, world_, 0.1, random_));
};

/// Shows whatever features it is given.
class GivenImage final : public FakeImage {
 public:
  explicit GivenImage(const TrainingMap& map) : map_(map) {}
  Score compare(FeatureKind, std::size_t i) override {
    return LocalSimilarity({}, {}).compare(features, *map_.local(i));
  }
  std::size_t localFeatures() override { return features.size(); }
  const LocalFeatures* unprunedLocal() override { return &features; }

  LocalFeatures features;

 private:
  const TrainingMap& map_;
};

}  // namespace visual_localization::test

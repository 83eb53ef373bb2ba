#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numeric>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "geometry/pose_solver.h"
#include "geometry/rays.h"
#include "localization/pose_verifier.h"
#include "map/feature_store.h"
#include "test/support/landmark_world.h"
#include "visual_localization/features/feature_matcher.h"
#include "visual_localization/features/sift.h"
#include "visual_localization/localization/metric_pose.h"

namespace visual_localization {
namespace {

/// A map of a street, and what its camera sees from beside a training image.
class MatchedLandmarksTest : public testing::Test {
 protected:
  static constexpr std::size_t kImage = 14;

  /// Every fourth feature lies where it should not.
  LocalFeatures seenWithStrangers() {
    const LocalFeatures seen = test::viewOf(world_, camera_, poses_[kImage].camera, 0.3, random_).features;
    std::vector<Keypoint> keypoints = seen.keypoints().list();
    for (std::size_t i = 0; i < keypoints.size(); i += 4) keypoints[i].x_px = 640.0F - keypoints[i].x_px;
    std::vector<std::uint8_t> descriptors(seen.bytes(0), seen.bytes(0) + seen.size() * kSiftDimension);
    return LocalFeatures(std::move(keypoints), std::move(descriptors));
  }

  CameraModel camera_ = test::streetCamera();
  std::mt19937 random_{1};
  std::vector<test::DrivenPose> poses_ = test::drive({});
  std::vector<test::WorldPoint> world_ = test::pointsAlong(poses_, 6.0, random_);
  std::shared_ptr<const TrainingMap> map_ = test::mapOf(test::record(poses_, world_, 0.1, random_));
  LocalFeatures seen_ = seenWithStrangers();
  SessionChoice sessions_{*map_, true};
  PoseVerifier verifier_{*map_, {}, sessions_};
};

TEST_F(MatchedLandmarksTest, AgreeWhereTheProjectionIsAndDisagreeElsewhere) {
  verifier_.startImage(0, seen_, camera_);
  const std::optional<MetricPose> pose = verifier_.nearOneOf({kImage});
  ASSERT_TRUE(pose);
  const MatchedLandmarks& matched = verifier_.matched();
  const auto features = map_->local(matched.training_image);
  const auto geometry = map_->geometry(matched.training_image);
  std::size_t inliers = 0;
  for (const MatchedLandmark& landmark : matched.landmarks) {
    ASSERT_LT(landmark.training_feature, features->size());
    const auto seen = std::find_if(geometry->landmarks.begin(), geometry->landmarks.end(),
                                   [&](const auto& one) { return one.feature == landmark.training_feature; });
    ASSERT_NE(seen, geometry->landmarks.end());
    const Eigen::Vector3d landmark_m = geometry->camera.position_m + seen->offset_m.cast<double>();
    const Eigen::Vector2d expected_px = camera_.project(pose->camera.toCamera(landmark_m));
    const double distance_px = (expected_px - landmark.seen_px.cast<double>()).norm();
    if (landmark.inlier) {
      EXPECT_LT(distance_px, 2.0 * PoseVerifier::kTolerance_px);
    } else {
      EXPECT_GT(distance_px, 0.5 * PoseVerifier::kTolerance_px);
    }
    inliers += landmark.inlier ? 1 : 0;
  }
  EXPECT_GT(inliers, 20U);
  EXPECT_LE(inliers, pose->inliers);
  EXPECT_GT(matched.landmarks.size() - inliers, 3U) << "some features lie where they should not";
}

/// What is known of a landmark along the ray to it and across.
Eigen::Matrix3d covarianceOf(const SeenLandmark& landmark) {
  const Eigen::Matrix3d axes =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), landmark.offset_m.cast<double>()).toRotationMatrix();
  const Eigen::Vector3d sigmas_m(landmark.sigma_along_m, landmark.sigma_across_m, landmark.sigma_across_m);
  return axes * sigmas_m.cwiseAbs2().asDiagonal() * axes.transpose();
}

TEST_F(MatchedLandmarksTest, CountByHowWellTheyAreKnown) {
  MetricConfig config;
  config.training_images = 1;
  verifier_.configure(config);
  // A metre ahead: where the training image was taken nothing depends on how far a landmark is.
  const LocalFeatures seen = test::viewOf(world_, camera_, poses_[kImage + 1].camera, 0.3, random_).features;
  verifier_.startImage(0, seen, camera_);
  const std::optional<MetricPose> pose = verifier_.nearOneOf({kImage});
  ASSERT_TRUE(pose);
  const auto geometry = map_->geometry(kImage);
  std::vector<std::size_t> features;
  for (const SeenLandmark& landmark : geometry->landmarks) features.push_back(landmark.feature);
  const KeypointRays rays = raysOf(seen, camera_);
  std::vector<LandmarkMatch> sights;
  for (const FeatureMatch& match :
       matchSymmetric(seen, map_->local(kImage)->subset(features), PoseVerifier::kMatchRatio)) {
    const SeenLandmark& landmark = geometry->landmarks[match.b];
    sights.push_back({match.a, 0, rays.normalised[match.a], rays.sigmas[match.a],
                      geometry->camera.position_m + landmark.offset_m.cast<double>(), covarianceOf(landmark)});
  }
  const double tolerance = PoseVerifier::kTolerance_px / camera_.intrinsics().fx;
  const auto expected = solvePose(sights, tolerance, static_cast<std::size_t>(config.min_inliers));
  ASSERT_TRUE(expected);
  EXPECT_LT((pose->camera.position_m - expected->camera.position_m).norm(), 1e-7);
  const MetricPose::Covariance covariance = std::pow(config.sigma_factor, 2) * expected->covariance;
  EXPECT_LT((pose->covariance - covariance).norm(), 1e-6 * covariance.norm());
  EXPECT_NEAR(pose->reprojection_px, expected->median_error * camera_.intrinsics().fx, 1e-4);
}

TEST_F(MatchedLandmarksTest, AreThoseOfTheImageThatSharesMostInliers) {
  std::vector<TrainingImage> images;
  for (std::size_t i = 0; i < map_->size(); ++i) {
    images.push_back(map_->image(i));
    std::vector<SeenLandmark>& landmarks = images.back().geometry->landmarks;
    if (i != kImage) landmarks.resize(landmarks.size() / 3);
  }
  const TrainingMap map(map_->header(), std::move(images));
  SessionChoice sessions(map, true);
  PoseVerifier verifier(map, {}, sessions);
  verifier.startImage(0, seen_, camera_);
  ASSERT_TRUE(verifier.nearOneOf({kImage + 1}));
  EXPECT_GT(verifier.compared().size(), 3U);
  EXPECT_EQ(verifier.matched().training_image, kImage);
}

TEST_F(MatchedLandmarksTest, MayBeOneOfEachTrainingImage) {
  MetricConfig config;
  config.training_images = 11;
  config.min_inliers = 6;
  config.max_sigma_m = 100.0;
  std::vector<TrainingImage> images;
  for (std::size_t i = 0; i < map_->size(); ++i) images.push_back(map_->image(i));
  const auto matchesOf = [](const LocalFeatures& seen, const TrainingImage& image) {
    std::vector<std::size_t> features;
    for (const SeenLandmark& landmark : image.geometry->landmarks) features.push_back(landmark.feature);
    return matchSymmetric(seen, image.local.subset(features), PoseVerifier::kMatchRatio);
  };
  const LocalFeatures all = test::viewOf(world_, camera_, poses_[kImage].camera, 0.3, random_).features;
  const std::vector<FeatureMatch> ahead = matchesOf(all, images[kImage + 5]);
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < 11; ++i) chosen.push_back(ahead[i * ahead.size() / 11].a);
  const LocalFeatures seen = all.subset(chosen);
  for (std::size_t i = 0; i < 11; ++i) {  // each training image shows another one of these
    TrainingImage& image = images[kImage - 5 + i];
    std::vector<SeenLandmark>& landmarks = image.geometry->landmarks;
    std::set<std::uint32_t> others;
    for (const FeatureMatch& match : matchesOf(seen, image)) {
      if (match.a != i) others.insert(landmarks[match.b].id);
    }
    landmarks.erase(std::remove_if(landmarks.begin(), landmarks.end(),
                                   [&](const SeenLandmark& landmark) { return others.count(landmark.id) > 0; }),
                    landmarks.end());
  }
  const TrainingMap map(map_->header(), std::move(images));
  SessionChoice sessions(map, true);
  PoseVerifier verifier(map, config, sessions);
  verifier.startImage(0, seen, camera_);
  ASSERT_TRUE(verifier.nearOneOf({kImage}));
  const std::vector<MatchedLandmark>& matched = verifier.matched().landmarks;
  EXPECT_EQ(std::count_if(matched.begin(), matched.end(), [](const MatchedLandmark& one) { return one.inlier; }), 1);
}

/// A map in memory of which the features of one image are read only in part.
class HalfReadStore final : public FeatureStore {
 public:
  HalfReadStore(const TrainingMap& map, std::size_t image, std::size_t readable)
      : map_(map), image_(image), readable_(readable) {}

  std::shared_ptr<const LocalFeatures> local(std::size_t image) const override {
    if (image != image_) return map_.local(image);
    std::vector<std::size_t> first(readable_);
    std::iota(first.begin(), first.end(), std::size_t{0});
    return std::make_shared<const LocalFeatures>(map_.local(image)->subset(first));
  }
  std::shared_ptr<const GlobalFeatures> global(std::size_t image) const override { return map_.global(image); }
  std::shared_ptr<const VladDescriptor> vlad(std::size_t image) const override { return map_.vlad(image); }
  std::vector<std::uint8_t> preview(std::size_t image) const override { return map_.preview(image); }
  std::shared_ptr<const ImageGeometry> geometry(std::size_t image) const override { return map_.geometry(image); }
  std::size_t geometryCount() const override { return map_.geometryCount(); }
  std::size_t globalsKept() const override { return map_.globalsKept(); }

 private:
  const TrainingMap& map_;
  std::size_t image_;
  std::size_t readable_;
};

TEST_F(MatchedLandmarksTest, OfAnImageThatCannotBeReadAreLeftOut) {
  for (const std::size_t readable : {std::size_t{0}, std::size_t{map_->geometry(kImage)->landmarks.back().feature}}) {
    TrainingPoses poses;
    for (std::size_t i = 0; i < map_->size(); ++i) poses.add(map_->pose(i), map_->featureCount(i));
    const TrainingMap map(map_->header(), poses, std::make_unique<HalfReadStore>(*map_, kImage, readable));
    SessionChoice sessions(map, true);
    PoseVerifier verifier(map, {}, sessions);
    verifier.startImage(0, seen_, camera_);
    EXPECT_TRUE(verifier.nearOneOf({kImage})) << "by those beside it";
    EXPECT_NE(verifier.matched().training_image, kImage);
  }
}

}  // namespace
}  // namespace visual_localization

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include <gtest/gtest.h>

#include "localization/pose_verifier.h"
#include "test/support/landmark_world.h"
#include "visual_localization/localization/estimate.h"

namespace visual_localization {
namespace {

/// A map of a street, and what its camera sees from beside a training image.
class MatchedLandmarksTest : public testing::Test {
 protected:
  static constexpr std::size_t kImage = 14;

  /// Every fourth feature lies where it should not.
  SiftFeatures seenWithStrangers() {
    const SiftFeatures seen = test::viewOf(world_, camera_, poses_[kImage].camera, 0.3, random_).features;
    std::vector<SiftKeypoint> keypoints = seen.keypoints();
    for (std::size_t i = 0; i < keypoints.size(); i += 4) keypoints[i].x_px = 640.0F - keypoints[i].x_px;
    std::vector<std::uint8_t> descriptors(seen.descriptor(0),
                                          seen.descriptor(0) + seen.size() * SiftFeatures::kDescriptorSize);
    return SiftFeatures(std::move(keypoints), std::move(descriptors));
  }

  CameraModel camera_ = test::streetCamera();
  std::mt19937 random_{1};
  std::vector<test::DrivenPose> poses_ = test::drive({});
  std::vector<test::WorldPoint> world_ = test::pointsAlong(poses_, 6.0, random_);
  std::shared_ptr<const TrainingMap> map_ = test::mapOf(test::record(poses_, world_, 0.1, random_));
  SiftFeatures seen_ = seenWithStrangers();
  SessionChoice sessions_{*map_, true};
  PoseVerifier verifier_{*map_, {}, sessions_};
};

TEST_F(MatchedLandmarksTest, AgreeWhereTheProjectionIsAndDisagreeElsewhere) {
  verifier_.startImage(0, seen_, camera_);
  const std::optional<MetricPose> pose = verifier_.nearOneOf({kImage});
  ASSERT_TRUE(pose);
  const MatchedLandmarks& matched = verifier_.matched();
  const auto features = map_->sift(matched.training_image);
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
      EXPECT_LT(distance_px, 2.0 * MetricConfig().tolerance_px);
    } else {
      EXPECT_GT(distance_px, 0.5 * MetricConfig().tolerance_px);
    }
    inliers += landmark.inlier ? 1 : 0;
  }
  EXPECT_GT(inliers, 20U);
  EXPECT_LE(inliers, pose->inliers);
  EXPECT_GT(matched.landmarks.size() - inliers, 3U) << "some features lie where they should not";
}

}  // namespace
}  // namespace visual_localization

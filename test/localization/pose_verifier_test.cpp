#include "localization/pose_verifier.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "test/localization/pose_verifier_fixture.h"

namespace visual_localization {
namespace {

using test::kFew;
using test::kSecond_ns;
using test::PoseVerifierTest;

TEST_F(PoseVerifierTest, FindsThePoseToCentimetres) {
  for (const std::size_t i : {3, 14, 22, 40}) {
    verifier_.reset();
    const auto pose = verifyNear(0.0, i);
    ASSERT_TRUE(pose) << i;
    EXPECT_LT(pose->sigma_m(), 0.1) << i;
    EXPECT_LT(error_m(*pose, i), 4.0 * pose->sigma_m() + 0.02) << i;
    const CameraPose expected = street_.mappedNear(i, kBeside_m);
    EXPECT_LT(pose->camera.rotation.angularDistance(expected.rotation), 0.005) << i;
    EXPECT_LT(pose->reprojection_px, 1.5) << i;
    EXPECT_GT(pose->map_covariance(0, 0), 0.0) << i;
    EXPECT_EQ(verifier_.predictor().imagesSince(), 0U) << i;
  }
}

TEST_F(PoseVerifierTest, HasTheErrorOfTheImageWhoseLandmarksMadeIt) {
  std::vector<TrainingImage> images;
  for (std::size_t i = 0; i < street_.map().size(); ++i) images.push_back(street_.map().image(i));
  for (TrainingImage& image : images) {
    if (image.geometry) image.geometry->covariance.diagonal().head<2>().setConstant(100.0);
  }
  images[14].geometry->covariance.diagonal().head<2>().setConstant(0.01);
  const TrainingMap doubtful(street_.map().header(), images);
  SessionChoice sessions(doubtful, true);
  PoseVerifier verifier(doubtful, {}, sessions);
  const LocalFeatures seen = street_.fewSeenFrom(street_.trueNear(14, kBeside_m), 16, 60);
  verifier.startImage(0, seen, street_.camera());
  const auto pose = verifier.nearOneOf({14});
  ASSERT_TRUE(pose);
  EXPECT_GT(pose->map_covariance(0, 0), 90.0) << "the robot is nearest to image 14";
}

TEST_F(PoseVerifierTest, NamesTheTrainingImagesWhoseLandmarksItUses) {
  ASSERT_TRUE(verify(0.0, street_.seenFrom(street_.trueNear(14, kBeside_m)), {14}));
  std::vector<std::size_t> compared = verifier_.compared();
  std::sort(compared.begin(), compared.end());
  EXPECT_EQ(compared, (std::vector<std::size_t>{12, 13, 14, 15, 16}));
}

TEST_F(PoseVerifierTest, ComparesEachTrainingImageOnce) {
  ASSERT_TRUE(verifyNear(0.0, 14));
  const auto few = street_.fewSeenFrom(street_.trueNear(14, kBeside_m), 14, 8);
  EXPECT_FALSE(verify(1.0, few, {14})) << "too few, near the prediction and near the most similar";
  std::vector<std::size_t> compared = verifier_.compared();
  std::sort(compared.begin(), compared.end());
  EXPECT_EQ(std::unique(compared.begin(), compared.end()), compared.end());
}

TEST_F(PoseVerifierTest, LearnsNothingAboutTheCalibrationWhereItIsNotInTheMap) {
  Intrinsics wrong = street_.camera().intrinsics();
  wrong.fx *= 1.05;
  wrong.fy *= 1.05;
  const CameraModel camera(wrong);
  for (const bool mapped : {false, true}) {
    for (std::size_t i = 10; i < 30; ++i) {
      const LocalFeatures features = street_.seenFrom(street_.trueNear(i, kBeside_m));
      verifier_.startImage(static_cast<std::int64_t>(i) * kSecond_ns, features, camera, {}, mapped);
      verifier_.nearOneOf({i});
    }
    EXPECT_EQ(verifier_.focal().contradicts(), mapped);
  }
}

// A street's landmarks tell the focal length of each image to about 1 %.
TEST_F(PoseVerifierTest, RefusesACalibrationThatTheImagesContradict) {
  for (const double scale : {0.95, 1.05, 2.0}) {
    verifier_.reset();
    verifier_.resetCamera();
    Intrinsics wrong = street_.camera().intrinsics();
    wrong.fx *= scale;
    wrong.fy *= scale;
    std::size_t believed = 0;
    for (std::size_t i = 10; i < 30; ++i) {
      const auto features = street_.seenFrom(street_.trueNear(i, kBeside_m));
      if (verifyWith(CameraModel(wrong), static_cast<double>(i), features, {i - 1, i, i + 1})) ++believed;
    }
    EXPECT_LE(believed, 3U) << scale;
    EXPECT_TRUE(verifier_.focal().contradicts()) << scale;
    EXPECT_LT((verifier_.focal().scale() - 1.0) * (scale - 1.0), 0.0) << "the other way";
  }
}

TEST_F(PoseVerifierTest, HowWrongACalibrationMayBeIsChangedOnTheWay) {
  Intrinsics wrong = street_.camera().intrinsics();
  wrong.fx *= 1.03;
  wrong.fy *= 1.03;
  for (std::size_t i = 10; i < 30; ++i) {
    verifyWith(CameraModel(wrong), static_cast<double>(i), street_.seenFrom(street_.trueNear(i, kBeside_m)), {i});
  }
  ASSERT_TRUE(verifier_.focal().contradicts());
  MetricConfig config;
  config.max_focal_error = 0.1;
  verifier_.configure(config);
  EXPECT_FALSE(verifier_.focal().contradicts());
}

TEST_F(PoseVerifierTest, BelievesTheRightCalibrationAgain) {
  Intrinsics wrong = street_.camera().intrinsics();
  wrong.fx *= 1.05;
  wrong.fy *= 1.05;
  for (std::size_t i = 10; i < 30; ++i) {
    verifyWith(CameraModel(wrong), static_cast<double>(i), street_.seenFrom(street_.trueNear(i, kBeside_m)), {i});
  }
  ASSERT_TRUE(verifier_.focal().contradicts());
  verifier_.resetCamera();
  EXPECT_TRUE(verifyNear(40.0, 14));
  EXPECT_TRUE(verifyNear(41.0, 15)->confirmed);
}

TEST_F(PoseVerifierTest, TheCovarianceIsScaledAndThatOfTheRobotNotOfTheCamera) {
  MetricConfig config;
  config.sigma_factor = 1.0;
  verifier_.configure(config);
  const LocalFeatures features = street_.seenFrom(street_.trueNear(14, kBeside_m));
  const auto plain = verify(0.0, features, {14});
  config.sigma_factor = 3.0;
  verifier_.configure(config);
  verifier_.reset();
  const auto scaled = verify(100.0, features, {14});
  ASSERT_TRUE(plain && scaled);
  EXPECT_LT((scaled->covariance - 9.0 * plain->covariance).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(scaled->map_covariance, plain->map_covariance);

  SensorMount mount;
  mount.camera.position_m = {2.0, 0.0, 0.0};  // two metres ahead of the robot's origin
  verifier_.reset();
  features_ = features;
  verifier_.startImage(200 * kSecond_ns, features_, street_.camera(), mount);
  const auto robot = verifier_.nearOneOf({14});
  ASSERT_TRUE(robot);
  EXPECT_LT((robot->camera.position_m - plain->camera.position_m).norm(), 1e-9);
  EXPECT_NEAR((robot->base.translation() - robot->camera.position_m).norm(), 2.0, 1e-9);
  const Eigen::Vector3d lever_m = robot->base.translation() - robot->camera.position_m;
  // A turn of the camera by w moves the robot by w x lever.
  Eigen::Matrix3d lever;
  lever << 0.0, lever_m.z(), -lever_m.y(), -lever_m.z(), 0.0, lever_m.x(), lever_m.y(), -lever_m.x(), 0.0;
  MetricPose::Covariance by_camera = MetricPose::Covariance::Identity();
  by_camera.topRightCorner<3, 3>() = lever;
  const MetricPose::Covariance expected = 9.0 * by_camera * (plain->covariance) * by_camera.transpose();
  EXPECT_LT((robot->covariance - expected).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_GT(robot->map_covariance(0, 0) + robot->map_covariance(1, 1),
            plain->map_covariance(0, 0) + plain->map_covariance(1, 1));
}

TEST_F(PoseVerifierTest, AsManyInliersAsAreAskedForAreEnough) {
  const auto all = verifyNear(0.0, 14);
  ASSERT_TRUE(all);
  MetricConfig config;
  for (const int asked : {static_cast<int>(all->inliers), static_cast<int>(all->inliers) + 1}) {
    config.min_inliers = asked;
    config.min_inliers_predicted = asked;
    verifier_.configure(config);
    verifier_.reset();
    const auto again = verify(100.0, LocalFeatures(features_), {13, 14, 15});
    EXPECT_EQ(again.has_value(), asked == static_cast<int>(all->inliers)) << asked;
  }
}

TEST_F(PoseVerifierTest, TriesTwoPlacesThatAreApart) {
  const LocalFeatures features = street_.seenFrom(street_.trueNear(40, kBeside_m));
  features_ = features;
  verifier_.startImage(0, features_, street_.camera());
  EXPECT_TRUE(verifier_.nearOneOf({3, 4, 5, 40})) << "3, 4 and 5 are one place";
  verifier_.reset();
  verifier_.startImage(100 * kSecond_ns, features_, street_.camera());
  EXPECT_FALSE(verifier_.nearOneOf({3, 12, 40})) << "the third is not tried";
}

TEST_F(PoseVerifierTest, FindsNothingWhereNothingMatches) {
  std::mt19937 random(99);
  const auto poses = test::drive({});
  const auto elsewhere = test::pointsAlong(poses, 6.0, random);
  const auto view = test::viewOf(elsewhere, street_.camera(), poses[10].camera, 0.3, random);
  EXPECT_FALSE(verify(0.0, view.features, {9, 10, 11, 30}));
  EXPECT_FALSE(verify(1.0, LocalFeatures(), {9, 10, 11, 30}));
  EXPECT_EQ(verifier_.predictor().imagesSince(), 2U);
}

TEST_F(PoseVerifierTest, FindsNothingBeforeParticlesHaveComparedAnything) {
  EXPECT_FALSE(verify(0.0, street_.seenFrom(street_.trueNear(14, kBeside_m)), {}));
}

TEST_F(PoseVerifierTest, FollowsTheMotionWithoutParticles) {
  ASSERT_TRUE(verifyNear(0.0, 10));
  for (std::size_t i = 11; i < 20; ++i) {
    const auto features = street_.seenFrom(street_.trueNear(i, kBeside_m));
    const auto pose = verify(static_cast<double>(i - 10), features, {});
    ASSERT_TRUE(pose) << i;
    EXPECT_TRUE(pose->confirmed) << i;
    EXPECT_LT(error_m(*pose, i), 4.0 * pose->sigma_m() + 0.02) << i;
  }
}

TEST_F(PoseVerifierTest, FindsThePoseAfterAKidnapping) {
  ASSERT_TRUE(verifyNear(0.0, 5));
  ASSERT_TRUE(verifyNear(1.0, 6));
  const auto features = street_.seenFrom(street_.trueNear(38, kBeside_m));
  const auto pose = verify(2.0, features, {5, 6, 7, 8, 38, 20});
  ASSERT_TRUE(pose);
  EXPECT_LT(error_m(*pose, 38), 4.0 * pose->sigma_m() + 0.02);
}

TEST_F(PoseVerifierTest, AsksForFewerInliersNearThePrediction) {
  const auto few = street_.fewSeenFrom(street_.trueNear(11, kBeside_m), 11);
  ASSERT_EQ(few.size(), kFew);
  EXPECT_FALSE(verify(0.0, few, {10, 11, 12})) << "nothing predicts it";
  ASSERT_TRUE(verifyNear(1.0, 9));
  ASSERT_TRUE(verifyNear(2.0, 10));
  const auto pose = verify(3.0, few, {10, 11, 12});
  ASSERT_TRUE(pose);
  EXPECT_TRUE(pose->confirmed);
  EXPECT_LE(pose->inliers, kFew);
  EXPECT_LT(error_m(*pose, 11), 4.0 * pose->sigma_m() + 0.02);
}

// Four metres ahead of the last pose, of which no motion is known; 2 m and two sigmas are allowed.
TEST_F(PoseVerifierTest, AsksForMoreInliersFarFromThePrediction) {
  ASSERT_TRUE(verifyNear(0.0, 6));
  const auto few = street_.fewSeenFrom(street_.trueNear(10, kBeside_m), 6);
  EXPECT_FALSE(verify(1.0, few, {9, 10, 11}));
  EXPECT_TRUE(verifyNear(1.0, 10)) << "with all features it is believed";
  MetricConfig config;
  config.max_prediction_error_m = 5.0;
  verifier_.configure(config);
  verifier_.reset();
  ASSERT_TRUE(verifyNear(2.0, 6));
  EXPECT_TRUE(verify(3.0, few, {9, 10, 11})) << "only the distance was wrong";
}

TEST_F(PoseVerifierTest, PredictsForSomeSecondsOnly) {
  ASSERT_TRUE(verifyNear(0.0, 10));
  const auto few = street_.fewSeenFrom(street_.trueNear(10, kBeside_m), 10);
  EXPECT_TRUE(verify(4.9, few, {10}));
  EXPECT_FALSE(verify(10.0, few, {10})) << "5 s after the last pose nothing is predicted any more";
}

// Landmarks of a car that was parked elsewhere on the day of the map would agree like that.
TEST_F(PoseVerifierTest, DoesNotBelieveAPoseAsideOfTheMotionUntilTheNextImage) {
  const Eigen::Vector3d aside_m = kBeside_m + Eigen::Vector3d(3.0, 0.0, 0.0);
  const auto seenAside = [&](std::size_t i) { return street_.seenFrom(street_.trueNear(i, aside_m)); };
  ASSERT_TRUE(verifyNear(0.0, 10));
  EXPECT_TRUE(verify(1.0, seenAside(11), {10, 11, 12})) << "nobody knows how fast the robot is";
  verifier_.reset();
  ASSERT_TRUE(verifyNear(10.0, 10));
  ASSERT_TRUE(verifyNear(11.0, 11));
  EXPECT_FALSE(verify(12.0, seenAside(12), {11, 12, 13}));
  EXPECT_EQ(verifier_.predictor().imagesSince(), 1U);
  ASSERT_TRUE(verifyNear(13.0, 13)) << "the motion before leads on";
  EXPECT_FALSE(verify(14.0, seenAside(14), {13, 14, 15}));
  const auto again = verify(15.0, seenAside(15), {14, 15, 16});
  ASSERT_TRUE(again) << "the robot was pushed";
  EXPECT_LT((again->camera.position_m - street_.mappedNear(15, aside_m).position_m).norm(), 0.1);
}

// A corner between two images, with four metres of way: half of the turn aside of straight on.
TEST_F(PoseVerifierTest, BelievesAPoseAsideOfTheMotionWhereTheRobotTurnedThatWay) {
  constexpr double kWay_m = 4.0;
  constexpr double kTurn_rad = 1.4;
  MetricConfig config;
  config.max_prediction_error_m = 0.2;
  config.min_inliers = 12;
  verifier_.configure(config);
  const Eigen::Vector3d along_arc_m(-kWay_m * std::sin(0.5 * kTurn_rad), 0.0, kWay_m * std::cos(0.5 * kTurn_rad));
  for (const double turned_rad : {0.0, kTurn_rad}) {  // to the left
    verifier_.reset();
    for (const std::size_t i : {5U, 9U, 13U}) ASSERT_TRUE(verifyNear(100.0 * turned_rad + static_cast<double>(i), i));
    CameraPose there = street_.trueNear(13, kBeside_m + along_arc_m);
    there.rotation = there.rotation * Eigen::AngleAxisd(-turned_rad, Eigen::Vector3d::UnitY());
    const auto pose = verify(100.0 * turned_rad + 17.0, street_.seenFrom(there), {13, 14, 15, 16, 17, 18});
    EXPECT_EQ(pose.has_value(), turned_rad > 0.0) << turned_rad;
  }
}

TEST_F(PoseVerifierTest, ForgetsTheMotionOnReset) {
  ASSERT_TRUE(verifyNear(0.0, 10));
  const auto few = street_.fewSeenFrom(street_.trueNear(10, kBeside_m), 10);
  EXPECT_TRUE(verify(1.0, few, {10}));
  verifier_.reset();
  EXPECT_FALSE(verify(2.0, few, {10}));
}

// Of one house that has a twin elsewhere as many landmarks may agree, but soon no others do.
TEST_F(PoseVerifierTest, ConfirmsByTheInliersOfPosesThatFollowEachOther) {
  const auto most = static_cast<std::size_t>(MetricConfig().min_inliers_tracking);
  for (const std::size_t begin : {10U, 35U}) {  // the second time the robot was carried
    std::size_t together = 0;
    for (std::size_t i = begin; i < begin + 6; ++i) {
      const auto pose = seeSome(static_cast<double>(i), i);
      ASSERT_TRUE(pose) << i;
      together += pose->inliers;
      EXPECT_EQ(pose->confirmed, together >= most) << i << ", " << together;
    }
    EXPECT_GE(together, most);
  }
}

TEST_F(PoseVerifierTest, AResetForgetsTheInliersOfThePosesBefore) {
  for (std::size_t i = 10; i < 16; ++i) ASSERT_TRUE(seeSome(static_cast<double>(i), i));
  verifier_.reset();
  EXPECT_FALSE(seeSome(16.0, 16)->confirmed);
}

/// After a drive of 1 m/s.
class UnseenRobot : public PoseVerifierTest {
 protected:
  UnseenRobot() {
    for (std::size_t i = 5; i < 11; ++i) EXPECT_TRUE(seeSome(static_cast<double>(i), i));
  }
  /// Whether a pose `way_m` farther on is confirmed at once.
  bool isConfirmedAfter(double time_s, std::size_t way_m) {
    const auto pose = seeSome(10.0 + time_s, 10 + way_m);
    EXPECT_TRUE(pose);
    return pose && pose->confirmed;
  }
};

TEST_F(UnseenRobot, IsWhereItMayHaveDriven) { EXPECT_TRUE(isConfirmedAfter(9.0, 9)); }

TEST_F(UnseenRobot, MayHaveStood) { EXPECT_TRUE(isConfirmedAfter(9.0, 0)); }

TEST_F(UnseenRobot, MayHaveHurried) { EXPECT_TRUE(isConfirmedAfter(9.0, 14)); }

TEST_F(UnseenRobot, CannotBeFartherThanItDrives) { EXPECT_FALSE(isConfirmedAfter(9.0, 18)); }

TEST_F(UnseenRobot, MayBeAnywhereAfterALongWay) { EXPECT_FALSE(isConfirmedAfter(11.0, 11)); }

// Three metres apart: as far as nobody drives in a second who has not been seen to.
TEST_F(PoseVerifierTest, TwoPosesFarApartDoNotFollowEachOtherUntilTheSpeedIsKnown) {
  MetricConfig config;
  config.min_inliers_tracking = 45;
  verifier_.configure(config);
  EXPECT_FALSE(seeSome(0.0, 10)->confirmed);
  EXPECT_FALSE(seeSome(1.0, 13)->confirmed);
  EXPECT_TRUE(seeSome(2.0, 16)->confirmed);
}

TEST_F(PoseVerifierTest, RemembersThatPlantsMovedUntilHousesSayOtherwise) {
  constexpr double kWind_m = 0.03;
  // So little wind that 15 landmarks cannot tell.
  const LocalFeatures few = street_.fewOf(street_.seenInWind(street_.trueNear(14, kBeside_m), 0.013), 14);
  double time_s = 0.0;
  const auto sigmaOf_m = [&](const LocalFeatures& features) {
    const auto pose = verify(++time_s, features, {13, 14, 15});
    return pose ? pose->sigma_m() : 0.0;
  };
  const auto drive = [&](double wind_m, int images) {
    for (int i = 0; i < images; ++i) sigmaOf_m(street_.seenInWind(street_.trueNear(14, kBeside_m), wind_m));
  };
  drive(0.0, 1);
  const double alone_m = sigmaOf_m(few);
  ASSERT_GT(alone_m, 0.0);
  drive(kWind_m, 1);
  EXPECT_NEAR(sigmaOf_m(few), alone_m, 0.1 * alone_m) << "one image is not enough";
  drive(kWind_m, 6);
  EXPECT_GT(sigmaOf_m(few), 2.0 * alone_m);
  drive(0.0, 3);
  EXPECT_NEAR(sigmaOf_m(few), alone_m, 0.1 * alone_m);
  drive(kWind_m, 6);
  verifier_.reset();
  drive(0.0, 1);
  EXPECT_NEAR(sigmaOf_m(few), alone_m, 0.1 * alone_m);
}

TEST_F(PoseVerifierTest, WhileNothingIsSeenNothingSaysThatPlantsMove) {
  const LocalFeatures few = street_.fewOf(street_.seenInWind(street_.trueNear(14, kBeside_m), 0.013), 14);
  std::vector<double> sigmas_m;
  for (const int unseen : {0, 100}) {
    verifier_.reset();
    ASSERT_TRUE(verifyNear(1.0, 14));
    for (int i = 1; i <= unseen; ++i) EXPECT_FALSE(verify(1.0 + 0.01 * i, {}, {13, 14, 15}));
    const auto pose = verify(2.5, few, {13, 14, 15});
    ASSERT_TRUE(pose) << unseen;
    sigmas_m.push_back(pose->sigma_m());
  }
  EXPECT_DOUBLE_EQ(sigmas_m[1], sigmas_m[0]);
}

TEST_F(PoseVerifierTest, DoesNotBelieveWhatIsTooUncertain) {
  MetricConfig config;
  config.max_sigma_m = 1e-4;
  verifier_.configure(config);
  EXPECT_FALSE(verifyNear(0.0, 14));
  verifier_.configure({});
  EXPECT_TRUE(verifyNear(1.0, 14));
}

}  // namespace
}  // namespace visual_localization

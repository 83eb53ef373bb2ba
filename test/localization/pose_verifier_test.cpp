#include "localization/pose_verifier.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <random>
#include <utility>

#include <gtest/gtest.h>

#include "base/angles.h"
#include "localization/covariance.h"
#include "test/localization/street_map.h"
#include "test/support/fake_image.h"
#include "visual_localization/features/sift_matcher.h"

namespace visual_localization {
namespace {

using test::kFew;
using test::StreetMap;

constexpr std::int64_t kSecond_ns = 1'000'000'000;

/// Known by its features.
class SeenImage final : public test::FakeImage {
 public:
  SeenImage(const TrainingMap& map, SiftFeatures features) : map_(map), features_(std::move(features)) {}
  Score compare(FeatureKind, std::size_t i) override {
    return SiftSimilarity({}, {}).compare(features_, *map_.sift(i));
  }
  const SiftFeatures* unprunedSift() override { return &features_; }

 private:
  const TrainingMap& map_;
  SiftFeatures features_;
};

class PoseVerifierTest : public testing::Test {
 protected:
  /// After particles compared the image with these training images.
  std::optional<MetricPose> verify(double time_s, const SiftFeatures& features,
                                   const std::vector<std::size_t>& compared) {
    return verifyWith(street_.camera(), time_s, features, compared);
  }
  std::optional<MetricPose> verifyWith(const CameraModel& camera, double time_s, const SiftFeatures& features,
                                       const std::vector<std::size_t>& compared) {
    features_ = features;
    verifier_.startImage(static_cast<std::int64_t>(time_s * kSecond_ns), features_, camera);
    const auto pose = verifier_.nearPrediction();
    return pose ? pose : verifier_.nearOneOf(mostSimilar(compared));
  }
  std::vector<std::size_t> mostSimilar(const std::vector<std::size_t>& compared) {
    SeenImage image(street_.map(), features_);
    Scores scores(street_.map().size());
    scores.startImage(FeatureKind::kSift, [&image](FeatureKind kind, std::size_t i) { return image.compare(kind, i); });
    for (const std::size_t i : compared) scores[i];
    return scores.mostSimilar();
  }
  /// An image with all features from beside training image `i`.
  std::optional<MetricPose> verifyNear(double time_s, std::size_t i) {
    return verify(time_s, street_.seenFrom(street_.trueNear(i, kBeside_m)), {i - 1, i, i + 1});
  }
  /// Of the position, metres.
  double error_m(const MetricPose& pose, std::size_t i) const {
    return (pose.camera.position_m - street_.mappedNear(i, kBeside_m).position_m).norm();
  }

  const Eigen::Vector3d kBeside_m{0.3, -0.1, 0.4};
  StreetMap street_;
  SiftFeatures features_;  ///< of the last image
  SessionChoice sessions_{street_.map(), true};
  PoseVerifier verifier_{street_.map(), {}, sessions_};
};

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
    EXPECT_EQ(verifier_.imagesSince(), 0U) << i;
  }
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

TEST_F(PoseVerifierTest, PredictsWithAGrowingCovariance) {
  ASSERT_TRUE(verifyNear(0.0, 10));
  const auto pose = verifyNear(1.0, 11);
  ASSERT_TRUE(pose);
  verify(2.0, SiftFeatures(), {});
  const auto soon = verifier_.predicted();
  verify(4.0, SiftFeatures(), {});
  const auto later = verifier_.predicted();
  ASSERT_TRUE(soon && later);
  EXPECT_GT(soon->covariance_m2(0, 0), pose->covariance(0, 0) + pose->map_covariance(0, 0));
  EXPECT_GT(later->covariance_m2(0, 0), soon->covariance_m2(0, 0));
  EXPECT_GT(later->yaw_variance_rad2, soon->yaw_variance_rad2);
}

/// The covariance of position and heading that a pose has of itself and of the map.
MetricPose::Covariance allOf(const MetricPose& pose) { return pose.covariance + pose.map_covariance; }

TEST_F(PoseVerifierTest, TheVelocityLeadsStraightOnAndIsTheLessSureTheFarther) {
  const auto first = verifyNear(0.0, 10);
  const auto second = verifyNear(0.5, 11);
  ASSERT_TRUE(first && second);
  verify(2.0, SiftFeatures(), {});
  const auto prediction = verifier_.predicted();
  ASSERT_TRUE(prediction);
  const Eigen::Vector2d step_m = (second->base.translation() - first->base.translation()).head<2>();
  const Eigen::Vector2d way_m = 3.0 * step_m;  // in three times the time
  EXPECT_LT((prediction->position_m - second->base.translation().head<2>() - way_m).norm(), 1e-9);
  EXPECT_NEAR(prediction->yaw_rad, yawOf(second->base), 1e-12);
  EXPECT_NEAR(prediction->sigma_m, 0.5 * way_m.norm(), 1e-9);
  EXPECT_FALSE(prediction->by_odometry);
  const MetricPose::Covariance start = allOf(*second);
  const Eigen::Matrix2d expected_m2 =
      start.topLeftCorner<2, 2>() + std::pow(prediction->sigma_m, 2) * Eigen::Matrix2d::Identity();
  EXPECT_LT((prediction->covariance_m2 - expected_m2).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_NEAR(prediction->yaw_variance_rad2, start(5, 5) + std::pow(0.1 * way_m.norm(), 2), 1e-9);
}

TEST_F(PoseVerifierTest, OdometryLeadsWhereItWentAndAWrongHeadingLeadsAside) {
  OdometryConfig config;
  config.distance_sigma = 0.1;
  config.turn_sigma_rad_m = 0.05;
  OdometryTrack track(config);
  verifier_.useOdometry(track, config);
  const auto pose = verifyNear(0.0, 10);
  ASSERT_TRUE(pose);
  // 4 m ahead in a straight line, then 3 m to the left: 7 m of way, turned to the left.
  for (int i = 0; i <= 20; ++i) {
    const double ahead_m = 4.0 * std::min(1.0, i / 10.0);
    const double left_m = 3.0 * std::max(0.0, i / 10.0 - 1.0);
    track.add({i * kSecond_ns / 10, {ahead_m, left_m}, i > 10 ? 0.5 : 0.0});
  }
  verify(2.0, SiftFeatures(), {});
  const auto prediction = verifier_.predicted();
  ASSERT_TRUE(prediction);
  EXPECT_TRUE(prediction->by_odometry);
  const Eigen::Vector2d way_m = Eigen::Rotation2Dd(yawOf(pose->base)) * Eigen::Vector2d(4.0, 3.0);
  EXPECT_LT((prediction->position_m - pose->base.translation().head<2>() - way_m).norm(), 1e-6);
  EXPECT_NEAR(std::remainder(prediction->yaw_rad - yawOf(pose->base) - 0.5, 2.0 * kPi), 0.0, 1e-9);
  EXPECT_NEAR(prediction->sigma_m, 0.1 * 7.0, 1e-6);
  const double turn_rad = 0.05 * 7.0;
  const MetricPose::Covariance start = allOf(*pose);
  EXPECT_NEAR(prediction->yaw_variance_rad2, start(5, 5) + turn_rad * turn_rad, 1e-6);
  const Eigen::Vector2d aside_m(-way_m.y(), way_m.x());
  const Eigen::Matrix2d expected_m2 = start.topLeftCorner<2, 2>() + 0.49 * Eigen::Matrix2d::Identity() +
                                      (start(5, 5) + 0.25 * turn_rad * turn_rad) * aside_m * aside_m.transpose();
  EXPECT_LT((prediction->covariance_m2 - expected_m2).cwiseAbs().maxCoeff(), 1e-5);
}

// A robot that stands, whose wheels slip once.
TEST_F(PoseVerifierTest, OdometryIsBelievedAgainAfterTenPosesThatItAgreesWith) {
  const OdometryConfig config;
  OdometryTrack track(config);
  verifier_.useOdometry(track, config);
  double x_m = 0.0;
  track.add({0, {x_m, 0.0}, 0.0});
  ASSERT_TRUE(verifyNear(0.0, 10));
  /// Whether odometry leads to the image of this second, whose pose is solved then.
  const auto leads = [&](std::int64_t second, double slip_m) {
    for (int k = 1; k <= 5; ++k) {
      track.add({(second - 1) * kSecond_ns + k * kSecond_ns / 5, {x_m += 0.2 * slip_m, 0.0}, 0.0});
    }
    const SiftFeatures nothing;
    verifier_.startImage(second * kSecond_ns, nothing, street_.camera());
    const auto prediction = verifier_.predicted();
    EXPECT_TRUE(verifyNear(static_cast<double>(second), 10)) << second;
    return prediction && prediction->by_odometry;
  };
  for (int second = 1; second <= 3; ++second) EXPECT_TRUE(leads(second, 0.0)) << second;
  EXPECT_TRUE(leads(4, 4.0)) << "nobody knows yet that this is wrong";
  for (int second = 5; second <= 14; ++second) EXPECT_FALSE(leads(second, 0.0)) << second;
  EXPECT_TRUE(leads(15, 0.0));
}

/// A robot that stands and whose wheels say that it moved and turned in the second before an image: whether odometry is
/// still believed afterwards.
class OdometryAgreement : public PoseVerifierTest {
 protected:
  bool stillBelieved(double moved_m, double turned_rad) {
    OdometryTrack track(config_);
    verifier_.useOdometry(track, config_);
    verifier_.reset();
    const SiftFeatures seen = street_.seenFrom(street_.trueNear(10, kBeside_m));
    begin_s_ += 1000.0;
    const auto at = [this](double time_s) { return static_cast<std::int64_t>((begin_s_ + time_s) * kSecond_ns); };
    const auto look = [&](double time_s) { return verify(begin_s_ + time_s, seen, {9, 10, 11}); };
    for (int k = -150; k <= 0; ++k) track.add({at(0.1 * k), {0.0, 0.0}, 0.0});
    for (int second = -12; second < 0; ++second) look(second);  // so that it is believed again
    const auto first = look(0.0);
    EXPECT_TRUE(first);
    for (int k = 1; k <= 15; ++k) {  // up to half a second after the image
      const double share = std::min(1.0, 0.1 * k);
      track.add({at(0.1 * k), {share * moved_m, 0.0}, share * turned_rad});
    }
    sigma_m_ = first ? largerSigma(allOf(*first).topLeftCorner<2, 2>()) : 0.0;
    EXPECT_TRUE(look(1.0));
    verifier_.startImage(at(1.2), seen, street_.camera());
    const auto prediction = verifier_.predicted();
    return prediction && prediction->by_odometry;
  }

  OdometryConfig config_;
  double begin_s_ = 0.0;
  double sigma_m_ = 0.0;  ///< of where odometry leads
};

TEST_F(OdometryAgreement, WithinThirtyCentimetresAndThreeSigmas) {
  config_.distance_sigma = 0.0001;
  EXPECT_TRUE(stillBelieved(0.0, 0.0));
  const double most_m = 0.3 + 3.0 * sigma_m_;
  ASSERT_GT(sigma_m_, 0.01) << "otherwise 3 sigmas look like 6";
  EXPECT_TRUE(stillBelieved(most_m - 0.02, 0.0));
  EXPECT_FALSE(stillBelieved(most_m + 0.02, 0.0));
  EXPECT_TRUE(stillBelieved(-most_m + 0.02, 0.0));
  EXPECT_FALSE(stillBelieved(-most_m - 0.02, 0.0));
}

TEST_F(OdometryAgreement, WithinThreeTenthsOfARadian) {
  for (const double direction : {1.0, -1.0}) {
    EXPECT_TRUE(stillBelieved(0.0, direction * 0.28)) << direction;
    EXPECT_FALSE(stillBelieved(0.0, direction * 0.32)) << direction;
  }
}

TEST_F(PoseVerifierTest, OdometryLeadsNoFartherThanIsBelieved) {
  for (const double max_distance_m : {7.5, 6.5}) {
    OdometryConfig config;
    config.max_distance_m = max_distance_m;
    OdometryTrack track(config);
    verifier_.useOdometry(track, config);
    verifier_.reset();
    ASSERT_TRUE(verifyNear(0.0, 10));
    for (int i = 0; i <= 10; ++i) track.add({i * kSecond_ns / 10, {0.7 * i, 0.0}, 0.0});
    verify(1.0, SiftFeatures(), {});
    const auto prediction = verifier_.predicted();
    ASSERT_TRUE(prediction) << "otherwise by the velocity";
    EXPECT_EQ(prediction->by_odometry, max_distance_m > 7.0);
  }
}

TEST_F(PoseVerifierTest, NothingIsPredictedForTimesBeforeThePose) {
  ASSERT_TRUE(verifyNear(100.0, 10));
  EXPECT_TRUE(verifier_.predicted()) << "of the same moment";
  verify(99.0, SiftFeatures(), {});
  EXPECT_FALSE(verifier_.predicted());
}

// Four metres a second predict four metres on, and that to 2 m of its own beside the 2 m that are allowed.
TEST_F(PoseVerifierTest, AFastRobotMayBeFartherFromItsPrediction) {
  ASSERT_TRUE(verifyNear(0.0, 6));
  ASSERT_TRUE(verifyNear(1.0, 10));
  const auto few = street_.fewSeenFrom(street_.trueNear(11, kBeside_m), 14);
  EXPECT_TRUE(verify(2.0, few, {11})) << "3 m short of the prediction";
}

TEST_F(PoseVerifierTest, TheCovarianceIsScaledAndThatOfTheRobotNotOfTheCamera) {
  MetricConfig config;
  config.sigma_factor = 1.0;
  verifier_.configure(config);
  const SiftFeatures features = street_.seenFrom(street_.trueNear(14, kBeside_m));
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
    const auto again = verify(100.0, SiftFeatures(features_), {13, 14, 15});
    EXPECT_EQ(again.has_value(), asked == static_cast<int>(all->inliers)) << asked;
  }
}

TEST_F(PoseVerifierTest, TriesTwoPlacesThatAreApart) {
  const SiftFeatures features = street_.seenFrom(street_.trueNear(40, kBeside_m));
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
  EXPECT_FALSE(verify(1.0, SiftFeatures(), {9, 10, 11, 30}));
  EXPECT_EQ(verifier_.imagesSince(), 2U);
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
  ASSERT_TRUE(verifyNear(1.0, 10));
  const auto pose = verify(2.0, few, {10, 11, 12});
  ASSERT_TRUE(pose);
  EXPECT_TRUE(pose->confirmed);
  EXPECT_LE(pose->inliers, kFew);
  EXPECT_LT(error_m(*pose, 11), 4.0 * pose->sigma_m() + 0.02);
}

// Four metres ahead of the last pose, of which no motion is known; two are allowed.
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

TEST_F(PoseVerifierTest, ForgetsTheMotionOnReset) {
  ASSERT_TRUE(verifyNear(0.0, 10));
  const auto few = street_.fewSeenFrom(street_.trueNear(10, kBeside_m), 10);
  EXPECT_TRUE(verify(1.0, few, {10}));
  verifier_.reset();
  EXPECT_FALSE(verify(2.0, few, {10}));
}

// Between 20 and 40 inliers a pose counts, but what follows must agree.
TEST_F(PoseVerifierTest, ConfirmsAPoseByTheNextOne) {
  const auto first = verify(0.0, street_.fewSeenFrom(street_.trueNear(10, kBeside_m), 10, 30), {10});
  ASSERT_TRUE(first);
  EXPECT_FALSE(first->confirmed);
  const auto second = verify(1.0, street_.fewSeenFrom(street_.trueNear(11, kBeside_m), 11, 30), {11});
  ASSERT_TRUE(second);
  EXPECT_TRUE(second->confirmed);
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

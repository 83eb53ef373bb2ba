// What an estimate says of itself where landmarks verify the pose.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "base/time.h"
#include "test/localization/street_map.h"
#include "test/support/stamps.h"
#include "test/support/swarm_config.h"
#include "visual_localization/localization/localizer.h"

namespace visual_localization {
namespace {

using test::GivenImage;
using test::kSecond_ns;

const Eigen::Vector3d kHere_m = Eigen::Vector3d::Zero();

/// A robot on the street, one image a second and a metre.
class MetricEstimate : public testing::Test {
 protected:
  MetricEstimate() { make({}); }

  void make(const LocalizerConfig& config) {
    const std::shared_ptr<const TrainingMap> map(std::shared_ptr<void>(), &street_.map());
    image_ = std::make_shared<GivenImage>(street_.map());
    localizer_ = std::make_unique<Localizer>(map, config, image_);
  }
  /// The next image, taken at training image `i`.
  Estimate see(std::size_t i) { return show(street_.seenFrom(street_.trueNear(i, kHere_m))); }
  Estimate seeFew(std::size_t i) { return show(street_.fewSeenFrom(street_.trueNear(i, kHere_m), i)); }
  Estimate seeNothing() { return show({}); }
  Estimate show(LocalFeatures features) {
    image_->features = std::move(features);
    return localizer_->process(++images_ * kSecond_ns, cv::Mat());
  }
  /// Ten readings until the next image, of a robot that drives a metre to `x_m`, or `way_m` if its wheels slip.
  void odometryTo(double x_m, double way_m = 1.0) {
    for (int k = 1; k <= 10; ++k) {
      const std::int64_t stamp_ns = images_ * kSecond_ns + k * kSecond_ns / 10;
      localizer_->addOdometry({stamp_ns, {x_m - way_m + 0.1 * k * way_m, 0.0}, 0.0});
    }
  }
  Eigen::Vector2d positionOf(std::size_t i) const { return street_.mappedNear(i, kHere_m).position_m.head<2>(); }

  test::StreetMap street_;
  std::shared_ptr<GivenImage> image_;
  std::unique_ptr<Localizer> localizer_;
  std::int64_t images_ = 0;
};

TEST_F(MetricEstimate, SaysWhatItRestsOn) {
  for (std::size_t i = 10; i < 20; ++i) {
    const Estimate estimate = see(i);
    ASSERT_TRUE(estimate.metric) << i;
    EXPECT_EQ(estimate.source, PoseSource::kMetric);
    EXPECT_EQ(estimate.images_since_metric, 0U);
    EXPECT_EQ(estimate.pose.position_m, estimate.metric->base.translation().head<2>().eval());
    const MetricPose::Covariance covariance = estimate.metric->covariance + estimate.metric->map_covariance;
    EXPECT_EQ(estimate.pose.covariance_m2, (covariance.topLeftCorner<2, 2>().eval()));
    EXPECT_EQ(estimate.pose.yaw_variance_rad2, covariance(5, 5));
    EXPECT_GT(estimate.metric->reprojection_px, 0.05);
    EXPECT_LT(estimate.metric->reprojection_px, 1.0);
    EXPECT_NEAR(estimate.focal_scale, 1.0, 0.01);
    if (i == 10) continue;
    EXPECT_EQ(estimate.comparisons, 5U) << "the training images around the prediction, and no other";
    EXPECT_LE(std::abs(static_cast<int>(estimate.tracked.best_image) - static_cast<int>(i)), 2);
    EXPECT_GT(estimate.tracked.best.similarity, 0.0);
    const double distance_m = (street_.map().position_m(estimate.tracked.best_image) - estimate.pose.position_m).norm();
    EXPECT_NEAR(estimate.tracked.best_distance_m, distance_m, 1e-9);
    EXPECT_TRUE(estimate.evidence.verified.value_or(false));
    EXPECT_FALSE(estimate.evidence.blind);
  }
  for (std::size_t since = 1; since <= 3; ++since) {
    const Estimate estimate = seeNothing();
    EXPECT_EQ(estimate.images_since_metric, since);
    EXPECT_TRUE(estimate.evidence.blind);
    EXPECT_FALSE(estimate.evidence.verified.value_or(true));
  }
}

TEST_F(MetricEstimate, AVerifiedPoseBringsTheParticles) {
  LocalizerConfig config = test::swarmConfig();
  config.state.max_step_m = 2.0;
  config.metric.min_inliers_tracking = config.metric.min_inliers;
  make(config);
  for (std::size_t i = 3; i < 8; ++i) see(i);
  const Estimate estimate = see(40);
  ASSERT_TRUE(estimate.metric);
  ASSERT_TRUE(estimate.metric->confirmed);
  for (const Particle& particle : localizer_->particles()) {
    EXPECT_LT((particle.position_m - positionOf(40)).norm(), 6.0);
  }
}

TEST_F(MetricEstimate, AVerifiedPoseBringsParticlesThatAreWideApartAroundIt) {
  LocalizerConfig config = test::swarmConfig();
  config.state.max_step_m = 4.0;
  config.metric.min_inliers_tracking = config.metric.min_inliers;
  make(config);
  const Estimate estimate = see(30);
  ASSERT_TRUE(estimate.metric);
  ASSERT_TRUE(estimate.metric->confirmed);
  ASSERT_LT((estimate.tracked.position_m - positionOf(30)).norm(), config.state.max_step_m);
  ASSERT_GT(estimate.tracked.spread_m.maxCoeff(), config.state.max_step_m);
  for (const Particle& particle : localizer_->particles()) {
    EXPECT_LT((particle.position_m - positionOf(30)).norm(), 6.0);
  }
}

TEST_F(MetricEstimate, APoseThatIsNotConfirmedLeavesTheParticles) {
  LocalizerConfig config = test::swarmConfig();
  config.state.max_step_m = 2.0;
  make(config);
  for (std::size_t i = 3; i < 8; ++i) see(i);
  const Estimate estimate = show(street_.fewSeenFrom(street_.trueNear(40, kHere_m), 40, 30));
  ASSERT_TRUE(estimate.metric);
  ASSERT_FALSE(estimate.metric->confirmed) << "few inliers, and nothing leads there";
  EXPECT_FALSE(estimate.evidence.verified.value_or(true));
  double farthest_m = 0.0;
  for (const Particle& particle : localizer_->particles()) {
    farthest_m = std::max(farthest_m, (particle.position_m - positionOf(40)).norm());
  }
  EXPECT_GT(farthest_m, 10.0);
}

TEST_F(MetricEstimate, AMountHoldsFromTheNextImageAndForgetsTheMotion) {
  for (std::size_t i = 10; i < 14; ++i) see(i);
  const Estimate before = seeFew(14);
  ASSERT_EQ(before.source, PoseSource::kMetric) << "few landmarks are enough near the prediction";
  SensorMount mount;
  mount.camera.position_m = {2.0, 0.0, 0.0};
  localizer_->setMount(mount);
  EXPECT_NE(seeFew(14).source, PoseSource::kMetric) << "what is predicted was another point of the robot";
  const Estimate after = see(14);
  ASSERT_EQ(after.source, PoseSource::kMetric);
  EXPECT_NEAR((after.metric->base.translation() - after.metric->camera.position_m).norm(), 2.0, 1e-9);
  EXPECT_NEAR((after.pose.position_m - before.pose.position_m).norm(), 2.0, 0.2);
}

TEST_F(MetricEstimate, AnotherCameraIsJudgedByItsOwnImages) {
  for (std::size_t i = 10; i < 20; ++i) ASSERT_NEAR(see(i).focal_scale, 1.0, 0.01) << i;
  Intrinsics lens = localizer_->camera()->intrinsics();
  lens.fx *= 1.01;
  lens.fy *= 1.01;
  localizer_->setCamera(CameraModel(lens));
  const Estimate estimate = see(20);
  ASSERT_TRUE(estimate.metric);
  EXPECT_NEAR(estimate.focal_scale, 1.0 / 1.01, 0.01);
}

TEST_F(MetricEstimate, ACameraThatTheImagesContradictVerifiesNothing) {
  Intrinsics lens = localizer_->camera()->intrinsics();
  lens.fx *= 1.02;
  lens.fy *= 1.02;
  localizer_->setCamera(CameraModel(lens));
  std::size_t contradicted = 0;
  for (std::size_t i = 5; i < 45; ++i) {
    const Estimate estimate = see(i);
    if (!estimate.camera_contradicted) continue;
    ++contradicted;
    EXPECT_FALSE(estimate.evidence.verified);
    EXPECT_FALSE(estimate.other_lens) << "the lens is the map's, the calibration is not";
    EXPECT_EQ(estimate.source, PoseSource::kPlace) << i << ": the poses so far lead nowhere";
  }
  EXPECT_GT(contradicted, 10U);
}

TEST_F(MetricEstimate, ThroughAnotherLensPlacesAreNotTracked) {
  const Intrinsics lens = localizer_->camera()->intrinsics();
  const auto zoomed = [&lens](const LocalFeatures& features) {
    std::vector<Keypoint> keypoints = features.keypoints().list();
    for (Keypoint& keypoint : keypoints) {
      keypoint.x_px = static_cast<float>(lens.cx + 1.1 * (static_cast<double>(keypoint.x_px) - lens.cx));
      keypoint.y_px = static_cast<float>(lens.cy + 1.1 * (static_cast<double>(keypoint.y_px) - lens.cy));
    }
    return LocalFeatures(keypoints, features.bytes());
  };
  std::size_t contradicted = 0;
  for (std::size_t i = 5; i < 45; ++i) {
    const Estimate estimate = show(zoomed(street_.seenFrom(street_.trueNear(i, kHere_m))));
    if (!estimate.camera_contradicted) continue;
    ++contradicted;
    EXPECT_TRUE(estimate.other_lens) << i << ' ' << estimate.focal_scale;
    EXPECT_NE(estimate.state, LocalizationState::kTracking) << i;
    EXPECT_NE(estimate.cameraTrouble().find("another lens"), std::string::npos) << estimate.cameraTrouble();
  }
  EXPECT_GT(contradicted, 10U);
}

TEST_F(MetricEstimate, TheTimeOfGeometryIsThatOfThisImage) {
  const Estimate proposed = see(10);
  ASSERT_TRUE(proposed.metric);
  EXPECT_GT(proposed.image.match_ms, 0.0);
  const Estimate predicted = see(11);
  ASSERT_TRUE(predicted.metric);
  EXPECT_GT(predicted.image.match_ms, 0.0);
  LocalizerConfig places = test::swarmConfig();
  places.metric.pose_source = "place";
  localizer_->configure(places);
  EXPECT_EQ(see(12).image.match_ms, 0.0);
}

/// An image that shows nothing and takes a while to say so.
class SlowImage final : public test::FakeImage {
 public:
  Score compare(FeatureKind, std::size_t) override {
    const Stopwatch stopwatch;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    report_.match_ms += stopwatch.elapsed_ms();
    return {};
  }
  const LocalFeatures* unprunedLocal() override { return &nothing_; }
  ImageReport report() const override { return report_; }

 private:
  LocalFeatures nothing_;
  ImageReport report_;
};

TEST_F(MetricEstimate, NoTimeIsCountedTwice) {
  const std::shared_ptr<const TrainingMap> map(std::shared_ptr<void>(), &street_.map());
  LocalizerConfig config = test::swarmConfig();
  config.tracker = "pf_gaussian";  // sweeps nothing itself: geometry is the first to
  Localizer localizer(map, config, std::make_shared<SlowImage>());
  const Estimate estimate = localizer.process(kSecond_ns, cv::Mat());
  ASSERT_GT(estimate.swept, 0U);
  EXPECT_GE(estimate.image.match_ms, static_cast<double>(estimate.comparisons + estimate.swept));
  EXPECT_GE(estimate.update_ms, 0.0);
}

TEST_F(MetricEstimate, RelocalizingForgetsTheMotion) {
  for (std::size_t i = 10; i < 14; ++i) see(i);
  ASSERT_EQ(seeFew(14).source, PoseSource::kMetric);
  localizer_->relocalize();
  EXPECT_NE(seeFew(15).source, PoseSource::kMetric);
  double farthest_m = 0.0;
  for (const Particle& particle : localizer_->particles()) {
    farthest_m = std::max(farthest_m, (particle.position_m - positionOf(15)).norm());
  }
  EXPECT_GT(farthest_m, 15.0) << "the particles are all over the street";
}

TEST_F(MetricEstimate, DoubtForgetsTheMotion) {
  for (std::size_t i = 10; i < 14; ++i) see(i);
  localizer_->doubt();
  EXPECT_NE(seeFew(14).source, PoseSource::kMetric);
}

// Carried for four metres while nothing was seen: that is no velocity.
TEST_F(MetricEstimate, NoVelocityIsTakenAcrossADoubt) {
  for (std::size_t i = 10; i < 14; ++i) see(i);
  localizer_->doubt();
  ASSERT_EQ(see(17).source, PoseSource::kMetric);
  const Estimate led = seeNothing();
  EXPECT_LT((led.pose.position_m - positionOf(17)).norm(), 0.5);
}

TEST_F(MetricEstimate, ADoubtLeavesOdometry) {
  std::vector<Eigen::Vector2d> led_m[2];
  for (const bool doubts : {false, true}) {
    make({});
    for (std::size_t i = 10; i < 14; ++i) {
      odometryTo(static_cast<double>(i));
      see(i);
    }
    if (doubts) localizer_->doubt();
    for (std::size_t i = 14; i < 20; ++i) {
      odometryTo(static_cast<double>(i));
      led_m[doubts ? 1 : 0].push_back(seeNothing().pose.position_m);
    }
  }
  for (std::size_t k = 0; k < 6; ++k) EXPECT_LT((led_m[1][k] - led_m[0][k]).norm(), 0.05) << k;
  EXPECT_NEAR((led_m[1].back() - led_m[1].front()).norm(), 5.0, 1e-6) << "a metre for each image";
}

// The wheels turn twelve metres while the robot drives one: what it is compared with first lies far ahead.
TEST_F(MetricEstimate, ItsBestImageIsThatOfThePoseWhenTheWheelsSlip) {
  LocalizerConfig config = test::swarmConfig();
  config.odometry.max_speed_mps = 20.0;
  make(config);
  double x_m = 10.0;
  for (std::size_t i = 10; i < 14; ++i) {
    odometryTo(x_m += 1.0);
    see(i);
  }
  odometryTo(x_m + 12.0, 12.0);
  const Estimate estimate = see(14);
  ASSERT_EQ(estimate.source, PoseSource::kMetric);
  EXPECT_LT((estimate.pose.position_m - positionOf(14)).norm(), 0.3);
  EXPECT_LT(estimate.tracked.best_distance_m, 5.0);
}

TEST_F(MetricEstimate, OdometryIsJudgedByThePresentParameters) {
  for (const double max_speed_mps : {10.0, 0.5}) {
    make({});
    LocalizerConfig config = test::swarmConfig();
    config.odometry.max_speed_mps = max_speed_mps;
    localizer_->configure(config);
    for (std::size_t i = 2; i < 6; ++i) {
      odometryTo(static_cast<double>(i));
      see(i);
    }
    for (std::size_t i = 6; i < 14; ++i) {
      odometryTo(static_cast<double>(i));
      seeNothing();
    }
    odometryTo(14.0);
    const Estimate estimate = seeNothing();
    const double error_m = (estimate.pose.position_m - positionOf(14)).norm();
    const bool believed = max_speed_mps > 1.0;
    EXPECT_EQ(error_m < 2.0, believed) << error_m << " m; each reading is a jump at most";
  }
}

TEST_F(MetricEstimate, APlaceIsNeverSurerThanItsFloor) {
  LocalizerConfig config = test::swarmConfig();
  config.metric.pose_source = "place";
  make(config);
  Estimate estimate;
  for (std::size_t i = 5; i < 30; ++i) estimate = see(i);
  EXPECT_EQ(estimate.source, PoseSource::kPlace);
  EXPECT_FALSE(estimate.metric);
  EXPECT_FALSE(estimate.evidence.verified);
  constexpr double kFloor_m2 = LocalizerConfig::kMinPositionStd_m * LocalizerConfig::kMinPositionStd_m;
  constexpr double kYawFloor_rad2 = LocalizerConfig::kMinYawStd_rad * LocalizerConfig::kMinYawStd_rad;
  for (const int axis : {0, 1}) {
    const double spread_m2 = estimate.tracked.mode_covariance_m2(axis, axis);
    EXPECT_GE(estimate.pose.covariance_m2(axis, axis), kFloor_m2 + spread_m2) << axis;
    EXPECT_LT(estimate.pose.covariance_m2(axis, axis), 40.0) << axis;
  }
  EXPECT_GE(estimate.pose.yaw_variance_rad2, kYawFloor_rad2);
  EXPECT_LT(estimate.pose.yaw_variance_rad2, kYawFloor_rad2 + 0.04);
  EXPECT_GT(estimate.motion_residual_m, 0.0);
}

TEST_F(MetricEstimate, WithoutLandmarksTheMotionLeadsOn) {
  const auto odometryTo = [this](double x_m) {
    for (int k = 1; k <= 10; ++k) {
      localizer_->addOdometry({images_ * kSecond_ns + k * kSecond_ns / 10, {x_m + 0.1 * k, 0.0}, 0.0});
    }
  };
  localizer_->addOdometry({0, {0.0, 0.0}, 0.0});
  Estimate last;
  for (std::size_t i = 2; i < 8; ++i) {
    odometryTo(static_cast<double>(images_));
    last = see(i);
    ASSERT_EQ(last.source, PoseSource::kMetric) << i;
    EXPECT_EQ(last.pose.geodetic.latitude_deg, street_.map().frame().toGeodetic(last.pose.position_m).latitude_deg);
  }
  odometryTo(static_cast<double>(images_));
  const Estimate led = seeNothing();
  EXPECT_EQ(led.source, PoseSource::kNone) << "nothing in the image";
  const MetricPose::Covariance start = last.metric->covariance + last.metric->map_covariance;
  const Eigen::Vector2d ahead(std::cos(last.pose.yaw_rad), std::sin(last.pose.yaw_rad));
  EXPECT_LT((led.pose.position_m - last.pose.position_m - ahead).norm(), 0.01) << "a metre straight on";
  EXPECT_NEAR(led.pose.yaw_rad, last.pose.yaw_rad, 1e-6);
  EXPECT_GT(led.pose.yaw_variance_rad2, start(5, 5));
  EXPECT_LT(led.pose.yaw_variance_rad2, start(5, 5) + 0.01);
  EXPECT_EQ(led.pose.geodetic.latitude_deg, street_.map().frame().toGeodetic(led.pose.position_m).latitude_deg);
}

TEST_F(MetricEstimate, AProposedPoseAttractsTheTracker) {
  LocalizerConfig config = test::swarmConfig();
  config.state.max_step_m = 10000.0;  // the particles stay; only the attractor moves
  make(config);
  for (std::size_t i = 3; i < 8; ++i) see(i);
  ASSERT_EQ(see(40).source, PoseSource::kMetric);
  const Estimate blind = seeNothing();
  EXPECT_LT((blind.tracked.position_m - positionOf(40)).norm(), 0.5) << "an image of nothing moves no attractor";
}

TEST_F(MetricEstimate, AnImageThatLostItsLandmarksIsPassedOver) {
  std::vector<TrainingImage> images;
  for (std::size_t i = 0; i < street_.map().size(); ++i) images.push_back(street_.map().image(i));
  images[20].geometry->landmarks.clear();
  const auto map = std::make_shared<const TrainingMap>(street_.map().header(), images);
  image_ = std::make_shared<GivenImage>(*map);
  localizer_ = std::make_unique<Localizer>(map, test::swarmConfig(), image_);
  for (std::size_t i = 15; i < 25; ++i) EXPECT_EQ(see(i).source, PoseSource::kMetric) << i;
}

TEST_F(MetricEstimate, HasNoLandmarksToDrawWithoutAPose) {
  EXPECT_TRUE(localizer_->lastLandmarks().landmarks.empty());
  for (std::size_t i = 3; i < 6; ++i) see(i);
  EXPECT_FALSE(localizer_->lastLandmarks().landmarks.empty());
  seeNothing();
  EXPECT_TRUE(localizer_->lastLandmarks().landmarks.empty());
}

TEST(Estimate, SaysHowWrongTheCalibrationIs) {
  Estimate estimate;
  EXPECT_EQ(estimate.cameraTrouble(), "");
  estimate.camera_contradicted = true;
  estimate.focal_scale = 0.952;
  EXPECT_NE(estimate.cameraTrouble().find("95.2"), std::string::npos) << estimate.cameraTrouble();
}

TEST(Estimate, ItsSigmasAreThoseOfThePoseOrInRelationToTheMap) {
  Estimate estimate;
  estimate.pose.covariance_m2 << 4.0, 0.0, 0.0, 9.0;
  estimate.pose.yaw_variance_rad2 = 0.04;
  EXPECT_DOUBLE_EQ(estimate.sigma_m(), 3.0);
  EXPECT_DOUBLE_EQ(estimate.sigmaYaw_rad(), 0.2);
  estimate.metric = MetricPose();
  estimate.metric->covariance(0, 0) = 0.01;
  estimate.metric->covariance(1, 1) = 0.04;
  estimate.metric->covariance(5, 5) = 0.0001;
  estimate.metric->map_covariance = 100.0 * MetricPose::Covariance::Identity();
  EXPECT_DOUBLE_EQ(estimate.sigma_m(), 0.2);
  EXPECT_DOUBLE_EQ(estimate.sigmaYaw_rad(), 0.01);
}

}  // namespace
}  // namespace visual_localization

// Odometry leads over images that show nothing known, and does no harm where it is wrong.
#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "localization/pose_verifier.h"
#include "test/localization/street_map.h"
#include "test/support/stamps.h"
#include "test/support/swarm_config.h"
#include "visual_localization/localization/localizer.h"

namespace visual_localization {
namespace {

using test::GivenImage;
using test::kSecond_ns;

/// A robot on the street, one image a second and a metre, whose odometry begins somewhere else.
class DriveWithOdometry : public testing::Test {
 protected:
  explicit DriveWithOdometry(const char* tracker = "dpso") {
    LocalizerConfig config = test::swarmConfig();
    config.tracker = tracker;
    const std::shared_ptr<const TrainingMap> map(std::shared_ptr<void>(), &street_.map());
    image_ = std::make_shared<GivenImage>(street_.map());
    localizer_ = std::make_unique<Localizer>(map, config, image_);
  }

  /// Readings up to image `i`, which comes `early_s` before its usual time; the wheels turn `slip` times as far as the
  /// robot goes.
  void odometryTo(std::size_t i, double slip = 1.0, std::size_t early_s = 0) {
    const CameraPose here = street_.mappedNear(i, Eigen::Vector3d::Zero());
    const CameraPose before = street_.mappedNear(i - 1, Eigen::Vector3d::Zero());
    const Eigen::Vector2d step_m = (here.position_m - before.position_m).head<2>();
    for (int k = 1; k <= 10; ++k) {
      driven_m_ += slip * 0.1 * step_m;
      const Eigen::Vector2d turned_m = Eigen::Rotation2Dd(1.0) * driven_m_;
      const double yaw_rad = here.yaw_rad() + 1.0;
      localizer_->addOdometry({static_cast<std::int64_t>(i - early_s - 1) * kSecond_ns + k * kSecond_ns / 10,
                               turned_m + Eigen::Vector2d(100.0, -50.0), yaw_rad});
    }
  }
  Estimate see(std::size_t i) {
    image_->features = street_.seenFrom(street_.trueNear(i, Eigen::Vector3d::Zero()));
    return localizer_->process(static_cast<std::int64_t>(i) * kSecond_ns, cv::Mat());
  }
  Estimate seeNothing(std::size_t i) {
    image_->features = LocalFeatures();
    return localizer_->process(static_cast<std::int64_t>(i) * kSecond_ns, cv::Mat());
  }
  double error_m(const Estimate& estimate, std::size_t i) {
    return (estimate.pose.position_m - street_.mappedNear(i, Eigen::Vector3d::Zero()).position_m.head<2>()).norm();
  }

  test::StreetMap street_;
  std::shared_ptr<GivenImage> image_;
  std::unique_ptr<Localizer> localizer_;
  Eigen::Vector2d driven_m_ = Eigen::Vector2d::Zero();
};

TEST_F(DriveWithOdometry, LeadsOverAStretchOfNothing) {
  for (std::size_t i = 2; i <= 6; ++i) {
    odometryTo(i);
    ASSERT_EQ(see(i).source, PoseSource::kMetric) << i;
  }
  double sigma_before_m = 0.0;
  double yaw_variance_before_rad2 = 0.0;
  for (std::size_t i = 7; i <= 36; ++i) {  // round both bends
    odometryTo(i);
    const Estimate estimate = seeNothing(i);
    EXPECT_EQ(estimate.source, PoseSource::kNone) << i;
    EXPECT_LT(error_m(estimate, i), 1.0) << i;
    const double sigma_m = std::sqrt(estimate.pose.covariance_m2.trace());
    EXPECT_GT(sigma_m, sigma_before_m) << i;
    EXPECT_LT(error_m(estimate, i), 3.0 * sigma_m) << i;
    sigma_before_m = sigma_m;
    const double yaw_rad = street_.mappedNear(i, Eigen::Vector3d::Zero()).yaw_rad();
    EXPECT_NEAR(std::remainder(estimate.pose.yaw_rad - yaw_rad, 2.0 * kPi), 0.0, 0.1) << i;
    EXPECT_GT(estimate.pose.yaw_variance_rad2, yaw_variance_before_rad2) << i;
    yaw_variance_before_rad2 = estimate.pose.yaw_variance_rad2;
    const Eigen::Vector2d geodetic_m = street_.map().frame().toEastNorth(estimate.pose.geodetic);
    EXPECT_LT((geodetic_m - estimate.pose.position_m).norm(), 1e-3) << i;
  }
  odometryTo(37);
  const Estimate seen = see(37);
  ASSERT_EQ(seen.source, PoseSource::kMetric);
  EXPECT_TRUE(seen.metric->confirmed) << "odometry agrees";
}

TEST_F(DriveWithOdometry, LeadsWhereTheParticlesAreNot) {
  LocalizerConfig config = test::swarmConfig();
  config.state.max_distance_m = 0.1;
  localizer_->configure(config);
  for (std::size_t i = 2; i <= 6; ++i) {
    odometryTo(i);
    ASSERT_EQ(see(i).source, PoseSource::kMetric) << i;
  }
  int elsewhere = 0;
  for (std::size_t i = 7; i <= 36; ++i) {
    odometryTo(i);
    const Estimate estimate = seeNothing(i);
    EXPECT_LT(error_m(estimate, i), 1.0) << i;
    EXPECT_NE(estimate.pose.position_m, estimate.tracked.position_m) << i;
    elsewhere += (estimate.pose.position_m - estimate.tracked.position_m).norm() > 0.1 ? 1 : 0;
  }
  EXPECT_GT(elsewhere, 5);
}

TEST_F(DriveWithOdometry, WithoutOdometryTheWayIsUnknown) {
  for (std::size_t i = 2; i <= 6; ++i) see(i);
  Estimate estimate;
  for (std::size_t i = 7; i <= 36; ++i) estimate = seeNothing(i);
  EXPECT_GT(error_m(estimate, 36), 5.0);
}

TEST_F(DriveWithOdometry, WheelsThatSlipDoNoHarm) {
  for (std::size_t i = 2; i <= 40; ++i) {
    odometryTo(i, i % 7 < 3 ? 4.0 : 1.0);
    const Estimate estimate = see(i);
    EXPECT_EQ(estimate.source, PoseSource::kMetric) << i;
    EXPECT_LT(error_m(estimate, i), 0.3) << i;
    EXPECT_TRUE(i < 5 || estimate.metric->confirmed) << i;
  }
}

TEST_F(DriveWithOdometry, WheelsThatStandWhileTheRobotIsCarriedDoNoHarm) {
  for (std::size_t i = 2; i <= 40; ++i) {
    odometryTo(i, i > 10 ? 0.0 : 1.0);
    const Estimate estimate = see(i);
    EXPECT_EQ(estimate.source, PoseSource::kMetric) << i;
    EXPECT_LT(error_m(estimate, i), 0.3) << i;
  }
}

TEST_F(DriveWithOdometry, OdometryThatWasWrongIsNotBelievedAtOnce) {
  for (std::size_t i = 2; i <= 8; ++i) {
    odometryTo(i, 4.0);
    see(i);
  }
  odometryTo(9, 4.0);
  EXPECT_LT(error_m(seeNothing(9), 9), 1.0) << "by the velocity before";
}

TEST_F(DriveWithOdometry, ARobotThatWasCarriedElsewhereIsFound) {
  for (std::size_t i = 2; i <= 10; ++i) {
    odometryTo(i);
    see(i);
  }
  odometryTo(11);
  image_->features = street_.seenFrom(street_.trueNear(35, Eigen::Vector3d::Zero()));
  const Estimate estimate = localizer_->process(11 * kSecond_ns, cv::Mat());
  EXPECT_EQ(estimate.source, PoseSource::kMetric);
  EXPECT_LT(error_m(estimate, 35), 0.3);
}

TEST_F(DriveWithOdometry, APoseThatOdometryContradictsIsConfirmedLate) {
  for (std::size_t i = 2; i <= 10; ++i) {
    odometryTo(i);
    see(i);
  }
  std::size_t confirmed_after = 0;
  for (std::size_t i = 25; i < 50 && confirmed_after == 0; ++i) {  // 14 m farther on than a second ago
    i == 25 ? odometryTo(11) : odometryTo(i, 1.0, 14);
    image_->features = street_.seenFrom(street_.trueNear(i, Eigen::Vector3d::Zero()));
    const Estimate estimate = localizer_->process(static_cast<std::int64_t>(i - 14) * kSecond_ns, cv::Mat());
    ASSERT_EQ(estimate.source, PoseSource::kMetric) << i;
    EXPECT_LT(error_m(estimate, i), 0.3) << i;
    if (estimate.metric->confirmed) confirmed_after = i - 25;
  }
  EXPECT_GE(confirmed_after, 10U);
  EXPECT_LE(confirmed_after, 15U);
}

TEST_F(DriveWithOdometry, WhoIsToldThatItWasCarriedIsConfirmedAtOnce) {
  for (std::size_t i = 2; i <= 10; ++i) {
    odometryTo(i);
    see(i);
  }
  odometryTo(11);
  localizer_->relocalize();
  image_->features = street_.seenFrom(street_.trueNear(35, Eigen::Vector3d::Zero()));
  EXPECT_TRUE(localizer_->process(11 * kSecond_ns, cv::Mat()).metric->confirmed);
}

/// A place is recognised where image `i` was taken, by too few features for a pose.
class RecognisedPlace : public DriveWithOdometry {
 protected:
  Estimate recognise(std::size_t image, std::size_t i) {
    const CameraPose here = street_.trueNear(i, Eigen::Vector3d::Zero());
    image_->features = street_.fewSeenFrom(here, i, 10);
    return localizer_->process(static_cast<std::int64_t>(image) * kSecond_ns, cv::Mat());
  }
  double apart_m(const Estimate& estimate) const {
    return (estimate.pose.position_m - estimate.tracked.position_m).norm();
  }
};

TEST_F(RecognisedPlace, FarFromWhereOdometryLeadsItIsThePose) {
  for (std::size_t i = 2; i <= 6; ++i) {
    odometryTo(i);
    ASSERT_EQ(see(i).source, PoseSource::kMetric) << i;
  }
  int recognised = 0;
  for (std::size_t i = 7; i <= 30; ++i) {
    odometryTo(i);
    const Estimate estimate = i < 10 ? seeNothing(i) : recognise(i, 35);
    ASSERT_FALSE(estimate.metric) << i;
    if (!estimate.tracked.best.recognised || error_m(estimate, i) < 6.0) continue;
    EXPECT_EQ(estimate.source, PoseSource::kPlace) << i;
    ++recognised;
  }
  EXPECT_GT(recognised, 5);
}

TEST_F(RecognisedPlace, WhereOdometryLeadsToThatIsThePose) {
  for (std::size_t i = 2; i <= 6; ++i) {
    odometryTo(i);
    ASSERT_EQ(see(i).source, PoseSource::kMetric) << i;
  }
  int led = 0;
  for (std::size_t i = 7; i <= 14; ++i) {
    odometryTo(i);
    const Estimate estimate = recognise(i, i);
    ASSERT_FALSE(estimate.metric) << i;
    const bool is_near = error_m(estimate, i) < 4.0;  // those that show the same lie up to 10 m apart
    EXPECT_EQ(estimate.source, is_near ? PoseSource::kNone : PoseSource::kPlace) << i;
    if (!is_near || !estimate.tracked.best.recognised) continue;
    EXPECT_LT(error_m(estimate, i), 0.5) << i;
    ++led;
  }
  EXPECT_GE(led, 3);
}

TEST_F(RecognisedPlace, TheVelocityAloneDoesNotLeadFarFromTheParticles) {
  LocalizerConfig config = test::swarmConfig();
  config.state.max_distance_m = 0.1;
  localizer_->configure(config);
  for (std::size_t i = 2; i <= 6; ++i) ASSERT_EQ(see(i).source, PoseSource::kMetric) << i;
  const Estimate estimate = seeNothing(7);
  EXPECT_EQ(apart_m(estimate), 0.0) << "a metre from where the velocity leads";
  EXPECT_GT(error_m(estimate, 7), 0.1);
}

TEST_F(DriveWithOdometry, NoReadingsNoDifference) {
  test::StreetMap other;
  const auto image = std::make_shared<GivenImage>(other.map());
  Localizer without(std::shared_ptr<const TrainingMap>(std::shared_ptr<void>(), &other.map()), test::swarmConfig(),
                    image);
  localizer_->addOdometry({0, {0.0, 0.0}, 0.0});  // long before the images: of no use
  for (std::size_t i = 2; i <= 20; ++i) {
    const Estimate with = i % 5 == 0 ? seeNothing(i) : see(i);
    image->features = image_->features;
    const Estimate plain = without.process(static_cast<std::int64_t>(i) * kSecond_ns, cv::Mat());
    EXPECT_EQ(with.pose.position_m, plain.pose.position_m) << i;
    EXPECT_EQ(with.comparisons, plain.comparisons) << i;
  }
}

}  // namespace
}  // namespace visual_localization

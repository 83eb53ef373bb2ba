#include <set>
#include <string>

#include <gtest/gtest.h>

#include "test/localization/wall_street.h"
#include "test/support/swarm_config.h"
#include "visual_localization/localization/localizer.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

using test::kSecond;

/// A localizer that is on track, and whose parameters then change.
class Reconfiguration : public test::WallStreet {
 protected:
  void SetUp() override {
    drive(15);
    ASSERT_EQ(last_.state, LocalizationState::kTracking);
  }

  /// The largest error of the next images.
  double drive(int images) {
    double largest_m = 0.0;
    for (int i = 0; i < images; ++i, ++shown_) {
      const Eigen::Vector2d robot(0.6 * shown_ + 0.3, 0.0);
      last_ = localizer_.process(shown_ * kSecond, viewAt(robot.x()));
      largest_m = std::max(largest_m, (last_.pose.position_m - robot).norm());
      always_tracking_ = always_tracking_ && last_.state == LocalizationState::kTracking;
    }
    return largest_m;
  }

  /// Changes parameters and drives on; the track must not be lost.
  void changeAndDriveOn(const ParameterValues& values) {
    assignParameters(config_, values);
    localizer_.configure(config_);
    always_tracking_ = true;
    EXPECT_LT(drive(5), 4.0);
    EXPECT_TRUE(always_tracking_);
  }

  LocalizerConfig config_ = test::swarmConfig();
  Localizer localizer_{map(), config_};
  Estimate last_;
  int shown_ = 0;
  bool always_tracking_ = true;
};

TEST_F(Reconfiguration, TheTrackGoesOnWithAnotherTracker) {
  for (const std::string tracker : {"pf_gaussian", "pf_linear", "dpso"}) {
    SCOPED_TRACE(tracker);
    changeAndDriveOn({{"tracker", tracker}});
    EXPECT_EQ(localizer_.particles().size(), tracker == "dpso" ? 80U : 300U);
  }
}

TEST_F(Reconfiguration, TheTrackGoesOnWithOtherFeatures) {
  changeAndDriveOn({{"features", std::string("global")}});
  EXPECT_EQ(last_.evidence.features, FeatureKind::kGlobal);
  changeAndDriveOn({{"features", std::string("sift")}, {"match/mode", std::string("one_way")}, {"prune", false}});
  EXPECT_EQ(last_.evidence.features, FeatureKind::kLocal);
  EXPECT_EQ(last_.image.features_kept, last_.image.features_extracted);
}

TEST_F(Reconfiguration, TheTrackGoesOnWithMoreOrFewerParticles) {
  changeAndDriveOn({{"dpso/particles", std::int64_t{200}}});
  EXPECT_EQ(localizer_.particles().size(), 200U);
  changeAndDriveOn({{"dpso/particles", std::int64_t{30}}});
  EXPECT_EQ(localizer_.particles().size(), 30U);
}

TEST_F(Reconfiguration, ThresholdsLeaveTheCloudAlone) {
  const std::vector<Particle> before = localizer_.particles();
  assignParameters(config_, {{"similarity/sift_recognised", 0.04},
                             {"hybrid/sift_below", 8.0},
                             {"state/max_scale", 1.3},
                             {"fitness/distance_sigma", 9.0},
                             {"sweep_images", std::int64_t{10}}});
  localizer_.configure(config_);
  ASSERT_EQ(localizer_.particles().size(), before.size());
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(localizer_.particles()[i].position_m, before[i].position_m);
    EXPECT_EQ(localizer_.particles()[i].velocity_m, before[i].velocity_m);
  }
}

TEST_F(Reconfiguration, AnInvalidConfigurationChangesNothing) {
  LocalizerConfig invalid = config_;
  invalid.tracker = "pf_linear";
  invalid.dpso.v0 = 0.5;
  EXPECT_THROW(localizer_.configure(invalid), ParameterError);
  EXPECT_EQ(localizer_.particles().size(), 80U);
  changeAndDriveOn({});
}

TEST(Sweep, AReconfigurationSweepsTheImageAnew) {
  const auto map = test::mapAt(test::street(100, 1.0));
  Scores scores(map->size());
  scores.startImage(FeatureKind::kLocal, [](FeatureKind, std::size_t) { return Score{1.0, 1.0}; });
  MapSweep sweep(*map, 100, 100);
  Random random(1);
  sweep.draw(scores, random);
  sweep.configure(5, false);
  std::set<std::size_t> drawn;
  for (int i = 0; i < 200; ++i) drawn.insert(sweep.draw(scores, random));
  EXPECT_EQ(drawn.size(), 5U);
  EXPECT_LT(*drawn.rbegin(), map->size());
}

}  // namespace
}  // namespace visual_localization

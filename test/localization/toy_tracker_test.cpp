#include "test/localization/toy_tracker.h"

#include <algorithm>
#include <memory>

#include <gtest/gtest.h>

#include "test/localization/wall_street.h"
#include "test/support/swarm_config.h"
#include "test/support/world.h"
#include "visual_localization/localization/localizer.h"

namespace visual_localization {
namespace {

/// All that makes a tracker known.
void registerToy() {
  const std::vector<std::string> known = trackerNames();
  if (std::find(known.begin(), known.end(), "toy") != known.end()) return;
  registerTracker({"toy", "", [](const TrainingMap& map, const TrackerConfig& config, std::uint32_t seed) {
                     return std::make_unique<test::ToyTracker>(map, config, seed);
                   }});
}

class ToyTracker : public test::WallStreet {
 protected:
  static LocalizerConfig config() {
    registerToy();
    LocalizerConfig config = test::swarmConfig();
    config.prune = false;
    config.state.witness = "probability";
    assignParameters(config, {{"tracker", "toy"}});
    return config;
  }
};

TEST_F(ToyTracker, RunsThroughTheLocalizer) {
  Localizer localizer(map(), config());
  for (int i = 0; i < 12; ++i) {
    const double along_m = 10.0 + 0.6 * i;
    const Estimate estimate = localizer.process(i * test::kSecond, noisy(viewAt(along_m), i));
    if (i < 4) continue;
    EXPECT_LT((estimate.pose.position_m - Eigen::Vector2d(along_m, 0.0)).norm(), 1.0) << i;
    EXPECT_EQ(estimate.source, PoseSource::kPlace);
    EXPECT_GT(estimate.comparisons, 0U);
    EXPECT_LT(estimate.comparisons, map()->size()) << "only what it asks for is compared";
    EXPECT_EQ(estimate.tracked.report.value("hypotheses"), 60.0);
    EXPECT_EQ(estimate.tracked.report.value("v0"), 0.0) << "no swarm";
  }
  EXPECT_EQ(localizer.particles().size(), 60U);
}

TEST_F(ToyTracker, TakesOverAndGivesBackTheTrack) {
  LocalizerConfig swarm = config();
  swarm.tracker = "dpso";
  Localizer localizer(map(), swarm);
  double along_m = 10.0;
  int image = 0;
  const auto errorAfter = [&](int images) {
    double error_m = 0.0;
    for (int i = 0; i < images; ++i, ++image, along_m += 0.3) {
      const Estimate estimate = localizer.process(image * test::kSecond, noisy(viewAt(along_m), image));
      error_m = (estimate.pose.position_m - Eigen::Vector2d(along_m, 0.0)).norm();
    }
    return error_m;
  };
  EXPECT_LT(errorAfter(20), 1.0);
  localizer.configure(config());
  EXPECT_LT(errorAfter(5), 1.0);
  localizer.configure(swarm);
  EXPECT_EQ(localizer.particles().size(), 80U);
  EXPECT_LT(errorAfter(5), 1.0);
}

TEST_F(ToyTracker, FollowsAVerifiedPoseWithoutKnowingOfAny) {
  test::World world = test::roundWorld();
  test::ToyTracker tracker(world.map(), {}, 1);
  tracker.reset(around(test::onCircle(0.0), 3.0));
  for (int i = 0; i < 20; ++i) {
    test::Seen seen = world.from(test::onCircle(50.0));
    seen.verified_m = test::onCircle(0.6 * i);
    EXPECT_LT((test::see(tracker, seen).position_m - *seen.verified_m).norm(), 1.0) << i;
    EXPECT_EQ(seen.scores.comparisons(), 0U);
  }
}

TEST(TrackerRegistry, KnowsEachNameOnce) {
  EXPECT_THROW(registerTracker({"dpso", "", {}}), std::invalid_argument);
  EXPECT_THROW(trackerKind("kalman"), ParameterError);
  EXPECT_EQ(trackerKind("pf_linear").particles, "pf/particles");
}

TEST(TrackerReport, TellsWhatWasSetLast) {
  TrackerReport report;
  EXPECT_EQ(report.value("v0"), 0.0);
  report.set("v0", 1.0);
  report.set("phi2", 2.0);
  report.set("v0", 3.0);
  EXPECT_EQ(report.value("v0"), 3.0);
  EXPECT_EQ(report.value("phi2"), 2.0);
  for (const char* key : {"a", "b", "c", "d", "e", "f", "g", "h", "i", "j"}) report.set(key, 1.0);
  EXPECT_THROW(report.set("k", 1.0), std::length_error);
}

}  // namespace
}  // namespace visual_localization

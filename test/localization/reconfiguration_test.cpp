#include <map>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "geometry/rays.h"
#include "geometry/reconstruction.h"
#include "geometry/session_geometry.h"
#include "localization/pose_predictor.h"
#include "localization/pose_verifier.h"
#include "parameters/former_parameters.h"
#include "test/localization/wall_street.h"
#include "test/support/swarm_config.h"
#include "visual_localization/features/front_end.h"
#include "visual_localization/localization/localizer.h"
#include "visual_localization/map/map_builder.h"
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

TEST(FormerParameters, HaveTheValuesThatAreUsed) {
  const LocalizerConfig config;
  const std::map<std::string, double> in_use{
      {"bayes/comparisons", config.bayes.comparisons},
      {"bayes/exponent", 0.0},  // what suits the kind of features
      {"bayes/first_comparisons", config.bayes.first_comparisons},
      {"bayes/uniform", config.bayes.uniform},
      {"dpso/best_particles", config.dpso.best_particles},
      {"dpso/corridor", config.dpso.corridor_m},
      {"dpso/exclusion_radius", config.dpso.exclusion_radius_m},
      {"dpso/mode_radius", config.dpso.mode_radius_m},
      {"dpso/rival_share", config.dpso.rival_share},
      {"geometry/epipolar_tolerance", PairRule::kTolerance_px},
      {"geometry/fix_correlation", Reconstruction::kFixCorrelation},
      {"geometry/fix_loss", Reconstruction::kFixLoss},
      {"geometry/keypoint_sigma", kKeypointSigma_px},
      {"geometry/match_ratio", PairRule::kMatchRatio},
      {"geometry/max_residual", Reconstruction::kMaxResidual},
      {"geometry/min_landmarks", Reconstruction::kMinLandmarks},
      {"geometry/min_pair_inliers", PairRule::kMinInliers},
      {"geometry/window", static_cast<double>(GeometryConfig().window)},
      {"max_image_gap", kMaxImageGap_s},
      {"metric/keypoint_sigma", kKeypointSigma_px},
      {"metric/match_ratio", PoseVerifier::kMatchRatio},
      {"metric/max_focal_error", config.metric.max_focal_error},
      {"metric/max_gap", PosePredictor::kMaxGap_s},
      {"metric/max_prediction_error", config.metric.max_prediction_error_m},
      {"metric/max_sigma", config.metric.max_sigma_m},
      {"metric/min_inliers", config.metric.min_inliers},
      {"metric/min_inliers_predicted", config.metric.min_inliers_predicted},
      {"metric/sigma_factor", config.metric.sigma_factor},
      {"metric/tolerance", PoseVerifier::kTolerance_px},
      {"metric/training_images", config.metric.training_images},
      {"min_position_std", LocalizerConfig::kMinPositionStd_m},
      {"min_yaw_std", LocalizerConfig::kMinYawStd_rad},
      {"odometry/max_distance", config.odometry.max_distance_m},
      {"odometry/max_gap", config.odometry.max_gap_s},
      {"odometry/max_speed", config.odometry.max_speed_mps},
      {"odometry/share", config.odometry.share},
      {"similarity/global_exponent", config.similarity.global_exponent},
      {"similarity/global_recognised", config.similarity.global_recognised},
      {"similarity/votes_exponent", config.similarity.votes_exponent},
      {"similarity/votes_recognised", config.similarity.votes_recognised},
      {"state/frozen_time", config.state.frozen_time_s},
      {"state/images_to_confirm", config.state.images_to_confirm},
      {"state/max_distance", config.state.max_distance_m},
      {"state/max_step", config.state.max_step_m},
      {"state/min_features", config.state.min_features},
      {"state/min_global_similarity", config.state.min_global_similarity},
      {"state/min_matches", config.state.min_matches},
      {"state/min_place_ratio", config.state.min_place_ratio},
      {"state/min_similarity", config.state.min_similarity},
      {"state/off_map_images", config.state.off_map_images},
      {"state/window", config.state.window},
      {"sift/edge_threshold", SiftConfig().edge_threshold},
      {"sift/octave_layers", SiftConfig().octave_layers},
      {"sift/sigma", SiftConfig().sigma_px},
      {"state/motion_length", StateAssessor::kMotionLength},
      {"state/sure_similarity", config.state.sure_similarity},
  };
  const std::set<std::string> seen_by_one_file_alone{"few_features",      "geometry/pair_span", "hybrid/sift_in_doubt",
                                                     "learned/min_score", "map/preview_width",  "map/sift_backend",
                                                     "max_fix_age",       "sift_backend",       "tf_smoothing"};
  for (const auto& [name, value] : formerParameters()) {
    if (seen_by_one_file_alone.count(name) > 0) continue;
    ASSERT_EQ(in_use.count(name), 1U) << name;
    EXPECT_EQ(std::get<double>(value), in_use.at(name)) << name;
  }
  EXPECT_EQ(formerParameters().size(), in_use.size() + seen_by_one_file_alone.size());
}

TEST(FormerParameters, AreDeclaredNoMore) {
  LocalizerConfig config;
  MapBuilderConfig builder;
  const auto declared = parameters::values([&config](ParameterVisitor& visitor) { config.declare(visitor); });
  const auto of_builder = parameters::values([&builder](ParameterVisitor& visitor) { builder.declare(visitor); });
  for (const auto& [name, _] : formerParameters()) {
    EXPECT_EQ(declared.count(name) + of_builder.count(name), 0U) << name;
  }
}

}  // namespace
}  // namespace visual_localization

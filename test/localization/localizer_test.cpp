#include "visual_localization/localization/localizer.h"

#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "test/localization/wall_street.h"
#include "test/support/example_map.h"
#include "test/support/fake_image.h"
#include "test/support/swarm_config.h"
#include "test/support/synthetic.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

using test::kSecond;

using LocalizerTest = test::WallStreet;

TEST_F(LocalizerTest, AnEstimateAgreesWithItself) {
  Localizer localizer(map(), test::swarmConfig());
  Estimate estimate;
  for (int i = 0; i < 10; ++i) {
    estimate = localizer.process(i * kSecond, viewAt(0.5 * i + 0.3));
    EXPECT_EQ(estimate.stamp_ns, i * kSecond);
  }
  EXPECT_GT(estimate.image.features_kept, 0U);
  EXPECT_LT(estimate.image.features_kept, estimate.image.features_extracted);
  EXPECT_GE(estimate.pose.covariance_m2(0, 0), 0.25);
  const Eigen::Vector2d geodetic = map()->frame().toEastNorth(estimate.pose.geodetic);
  EXPECT_LT((geodetic - estimate.pose.position_m).norm(), 1e-6);
}

/// Every tracker with every choice of features.
class EveryCombination : public test::WallStreet,
                         public ::testing::WithParamInterface<std::tuple<const char*, const char*>> {};

INSTANTIATE_TEST_SUITE_P(TrackersAndFeatures, EveryCombination,
                         ::testing::Combine(::testing::Values("dpso", "dpso_multi", "pf_gaussian", "pf_linear"),
                                            ::testing::Values("sift", "global", "hybrid")),
                         [](const auto& combination) {
                           return std::string(std::get<0>(combination.param)) + "_" + std::get<1>(combination.param);
                         });

TEST_P(EveryCombination, TracksACameraAlongTheStreet) {
  LocalizerConfig config = test::swarmConfig();
  std::tie(config.tracker, config.features) = GetParam();
  Localizer localizer(map(), config);
  Estimate estimate;
  int by_sift = 0;
  double error_sum_m = 0.0;
  for (int i = 0; i < 45; ++i) {
    const double along_m = 0.6 * i + 0.3;
    estimate = localizer.process(i * kSecond, viewAt(along_m));
    const bool sift = estimate.evidence.features == FeatureKind::kLocal;
    by_sift += sift ? 1 : 0;
    EXPECT_EQ(estimate.image.features_extracted > 0, sift) << "global features need no SIFT";
    EXPECT_EQ(localizer.lastLocal().size(), estimate.image.features_kept);
    EXPECT_EQ(estimate.tracked.best.matches > 0, sift);
    if (i >= 15) error_sum_m += (estimate.pose.position_m - Eigen::Vector2d(along_m, 0.0)).norm();
  }
  EXPECT_LT(error_sum_m / 30.0, 1.5);
  EXPECT_EQ(estimate.state, LocalizationState::kTracking);
  EXPECT_GT(estimate.tracked.best.similarity, config.features == "sift" ? 0.2 : 0.8);
  EXPECT_LE(estimate.comparisons, map()->size());
  const bool hybrid = config.features == "hybrid";
  EXPECT_GE(by_sift, hybrid ? 1 : config.features == "sift" ? 45 : 0);
  EXPECT_LE(by_sift, hybrid ? 10 : config.features == "sift" ? 45 : 0);
}

TEST_P(EveryCombination, FogIsNeverATrackedPosition) {
  LocalizerConfig config = test::swarmConfig();
  std::tie(config.tracker, config.features) = GetParam();
  Localizer localizer(map(), config);
  const cv::Mat fog(240, 320, CV_8UC1, cv::Scalar(90));
  for (int i = 0; i < 20; ++i) {
    const Estimate estimate = localizer.process(i * kSecond, noisy(fog, i));
    EXPECT_NE(estimate.state, LocalizationState::kTracking);
    EXPECT_TRUE(estimate.pose.position_m.allFinite());
    EXPECT_TRUE(estimate.pose.covariance_m2.allFinite());
  }
}

TEST_F(LocalizerTest, TheSameSeedGivesTheSameTrack) {
  Localizer first(map(), test::swarmConfig());
  Localizer second(map(), test::swarmConfig());
  for (int i = 0; i < 10; ++i) {
    const cv::Mat view = viewAt(0.5 * i);
    EXPECT_EQ(first.process(i * kSecond, view).pose.position_m, second.process(i * kSecond, view).pose.position_m);
  }
}

/// By SIFT only: by global features two walls of the same blocks are alike.
TEST_F(LocalizerTest, AnotherPlaceIsNeverATrackedPosition) {
  const cv::Mat elsewhere = test::wall(1000, 240, 99);
  for (const char* tracker : {"dpso", "dpso_multi", "pf_gaussian", "pf_linear"}) {
    LocalizerConfig config = test::swarmConfig();
    config.tracker = tracker;
    Localizer localizer(map(), config);
    for (int i = 0; i < 30; ++i) {
      EXPECT_NE(localizer.process(i * kSecond, test::viewOf(elsewhere, 15 * i)).state, LocalizationState::kTracking);
    }
  }
}

TEST_F(LocalizerTest, RelocalizeForgetsAndFindsAgain) {
  Localizer localizer(map(), test::swarmConfig());
  for (int i = 0; i < 20; ++i) localizer.process(i * kSecond, noisy(viewAt(5.0), i));
  localizer.relocalize(around({30.0, 0.0}, 3.0));
  const Estimate first = localizer.process(20 * kSecond, noisy(viewAt(30.0), 20));
  EXPECT_EQ(first.state, LocalizationState::kInitializing);
  EXPECT_NEAR(first.pose.position_m.x(), 30.0, 3.0);
  Estimate last = first;
  for (int i = 21; i < 40; ++i) last = localizer.process(i * kSecond, noisy(viewAt(30.0), i));
  EXPECT_EQ(last.state, LocalizationState::kTracking);
  EXPECT_NEAR(last.pose.position_m.x(), 30.0, 1.5);
}

TEST_F(LocalizerTest, HybridBeginsWithSiftWheneverThePositionIsUnknown) {
  LocalizerConfig config = test::swarmConfig();
  config.features = "hybrid";
  Localizer localizer(map(), config);
  int shown = 0;
  const auto next = [&] {
    ++shown;
    return localizer.process(shown * kSecond, noisy(viewAt(12.0), shown));
  };
  for (const bool with_prior : {false, true}) {
    EXPECT_EQ(next().evidence.features, FeatureKind::kLocal);
    Estimate estimate;
    for (int i = 0; i < 9; ++i) estimate = next();  // the next one is looked after by SIFT
    EXPECT_EQ(estimate.evidence.features, FeatureKind::kGlobal);
    EXPECT_EQ(estimate.image.features_extracted, 0U);
    EXPECT_TRUE(localizer.lastLocal().empty());
    with_prior ? localizer.relocalize(around({12.0, 0.0}, 1.0)) : localizer.relocalize();
  }
  EXPECT_EQ(next().evidence.features, FeatureKind::kLocal);
}

/// An image that is as much like every training image, and counts what it is asked for.
class CountingImage final : public test::FakeImage {
 public:
  void show(double similarity) {
    similarity_ = similarity;
    by_sift = by_global = 0;
  }
  Score compare(FeatureKind kind, std::size_t) override {
    ++(kind == FeatureKind::kLocal ? by_sift : by_global);
    return {similarity_, similarity_, 50, similarity_ > 0.5};
  }
  std::size_t by_sift = 0;
  std::size_t by_global = 0;

 private:
  double similarity_ = 0.0;
};

TEST_F(LocalizerTest, ALargeMapIsSweptOnlyWhileThePositionIsUnknown) {
  LocalizerConfig config = test::swarmConfig();
  config.sweep_images = 20;
  config.state.place_check = false;
  const auto image = std::make_shared<CountingImage>();
  Localizer localizer(map(), config, image);
  for (int i = 0; i < 3; ++i) {
    image->show(0.1);
    const Estimate estimate = localizer.process(i * kSecond, {});
    EXPECT_EQ(image->by_global, 20U);
    EXPECT_EQ(estimate.swept, 20U);
    EXPECT_EQ(image->by_sift, estimate.comparisons) << "the sweep is counted by itself";
  }
  image->show(0.9);
  localizer.process(3 * kSecond, {});
  image->show(0.9);
  EXPECT_EQ(localizer.process(4 * kSecond, {}).swept, 0U);
  EXPECT_EQ(image->by_global, 0U);
  EXPECT_GT(image->by_sift, 0U);
}

TEST_F(LocalizerTest, TheWholeMapIsAskedOnlyWhenTheMatchIsNotSure) {
  LocalizerConfig config = test::swarmConfig();
  config.dpso.recovery = "none";
  config.sweep_images = 15;
  config.state.max_distance_m = 1000.0;  // alike everywhere, so the best match may be anywhere
  const auto image = std::make_shared<CountingImage>();
  Localizer localizer(map(), config, image);
  image->show(0.9);
  EXPECT_EQ(localizer.process(0, {}).evidence.place_ratio, 1.0);
  EXPECT_EQ(image->by_global, 0U);
  image->show(0.1);
  EXPECT_EQ(localizer.process(kSecond, {}).evidence.place_ratio, 1.0) << "alike everywhere";
  EXPECT_GE(image->by_global, 15U);
  EXPECT_LE(image->by_global, 15U + 32U) << "every fourth image, and those around the estimate";
}

TEST_F(LocalizerTest, NoScoreIsComputedTwiceForAnImage) {
  for (const char* features : {"sift", "global", "hybrid"}) {
    LocalizerConfig config = test::swarmConfig();
    config.features = features;
    const auto image = std::make_shared<CountingImage>();
    Localizer localizer(map(), config, image);
    for (int i = 0; i < 5; ++i) {
      image->show(0.1);  // unknown and unsure: the sweep guides the swarm and checks the estimate
      const Estimate estimate = localizer.process(i * kSecond, {});
      EXPECT_EQ(estimate.comparisons + estimate.swept, image->by_sift + image->by_global) << features;
      EXPECT_LE(image->by_global, map()->size()) << features;
    }
  }
}

TEST_F(LocalizerTest, OtherSizesAreResizedToTheMaps) {
  Localizer localizer(map(), test::swarmConfig());
  cv::Mat large;
  Estimate estimate;
  for (int i = 0; i < 30; ++i) {
    cv::resize(noisy(viewAt(10.0), i), large, cv::Size(640, 480), 0, 0, cv::INTER_CUBIC);
    estimate = localizer.process(i * kSecond, large);
  }
  EXPECT_EQ(estimate.state, LocalizationState::kTracking);
  EXPECT_NEAR(estimate.pose.position_m.x(), 10.0, 1.5);
}

TEST_F(LocalizerTest, RefusesABadImageAndGoesOn) {
  Localizer localizer(map(), test::swarmConfig());
  EXPECT_THROW(localizer.process(0, cv::Mat()), std::invalid_argument);
  EXPECT_THROW(localizer.process(0, cv::Mat(240, 320, CV_8UC3)), std::invalid_argument);
  EXPECT_THROW(localizer.process(0, cv::Mat(4, 4, CV_8UC1)), std::invalid_argument);
  EXPECT_NO_THROW(localizer.process(0, viewAt(10.0)));
}

TEST_F(LocalizerTest, RefusesABadConfiguration) {
  LocalizerConfig config = test::swarmConfig();
  config.dpso.particles = 0;
  EXPECT_THROW(Localizer(map(), config), ParameterError);
  config = test::swarmConfig();
  config.tracker = "crystal_ball";
  EXPECT_THROW(Localizer(map(), config), ParameterError);
}

TEST_F(LocalizerTest, ALiveImageIsRecognisedByThePresentThreshold) {
  const FrontEndConfig front_end = frontEndConfigOf(test::swarmConfig(), map()->header());
  LiveImage image(*map(), front_end, SimilarityConfig());
  image.set(0, viewAt(12.0));
  ASSERT_TRUE(image.compare(FeatureKind::kLocal, 20).recognised);
  SimilarityConfig strict;
  strict.sift_recognised = strict.global_recognised = 1.0;
  image.configure(front_end, strict);
  image.set(1, viewAt(12.3));
  const Score score = image.compare(FeatureKind::kLocal, 20);
  EXPECT_GT(score.matches, 0U);
  EXPECT_FALSE(score.recognised);
}

TEST_F(LocalizerTest, ALiveImageComparesByTheKindThatIsAskedFor) {
  const LocalSimilarity sift{MatchConfig(), SimilarityConfig()};
  LiveImage image(*map(), frontEndConfigOf(test::swarmConfig(), map()->header()), SimilarityConfig());
  image.set(0, viewAt(12.0 + 1e-9));
  EXPECT_FALSE(image.local()) << "nothing was asked for yet";
  EXPECT_EQ(image.report().features_kept, 0U);

  const Score by_global = image.compare(FeatureKind::kGlobal, 20);
  EXPECT_FALSE(image.local()) << "global features need no SIFT";
  EXPECT_EQ(by_global.similarity, 1.0);  // training image 20 was taken here
  EXPECT_EQ(by_global.matches, 0U);
  EXPECT_LT(image.compare(FeatureKind::kGlobal, 40).similarity, 0.9);
  const double global_ms = image.report().match_ms;
  EXPECT_GT(global_ms, 0.0);

  const Score by_sift = image.compare(FeatureKind::kLocal, 20);
  EXPECT_EQ(by_sift.similarity, sift.compare(*image.local(), map()->image(20).local).similarity);
  EXPECT_GT(by_sift.matches, 50U);
  EXPECT_GT(by_sift.matches, 10 * image.compare(FeatureKind::kLocal, 50).matches);
  EXPECT_GT(image.report().match_ms, global_ms);
}

TEST_F(LocalizerTest, ALiveImageIsComparedByVladWhereTheMapHoldsIt) {
  MapHeader header = map()->header();
  std::vector<TrainingImage> images;
  for (std::size_t i = 0; i < map()->size(); ++i) images.push_back(map()->image(i));
  const auto features = [&images](std::size_t i) { return std::make_shared<const LocalFeatures>(images[i].local); };
  header.vocabulary = VladVocabulary::learn(images.size(), features, header.image_size);
  ASSERT_TRUE(header.vocabulary);
  for (TrainingImage& training : images) training.vlad = header.vocabulary->describe(training.local);
  const TrainingMap with_vlad(header, std::move(images));
  LiveImage image(with_vlad, frontEndConfigOf(test::swarmConfig(), header), SimilarityConfig());
  image.set(0, viewAt(12.0 + 1e-9));
  const double there = image.compare(FeatureKind::kVlad, 20).similarity;
  EXPECT_GT(there, 0.9);
  EXPECT_LT(image.compare(FeatureKind::kVlad, 50).similarity, 0.5 * there);
  image.set(1, viewAt(30.0));
  EXPECT_LT(image.compare(FeatureKind::kVlad, 20).similarity, 0.5 * there) << "of the image before";
}

TEST_F(LocalizerTest, TheCameraIsTheMapsUntilAnotherOneIsGiven) {
  EXPECT_FALSE(Localizer(map(), test::swarmConfig()).camera());
  MapHeader header = map()->header();
  header.sessions.front().camera = test::exampleCamera();
  Localizer localizer(std::make_shared<TrainingMap>(header, std::vector<TrainingImage>{map()->image(0)}),
                      test::swarmConfig());
  EXPECT_EQ(localizer.camera(), test::exampleCamera());
  const CameraModel other({{640, 360}, 500.0, 500.0, 320.0, 180.0, Distortion::kPlumbBob, {}});
  localizer.setCamera(other);
  EXPECT_EQ(localizer.camera(), other.scaledTo({320, 240})) << "like the images";
}

TEST_F(LocalizerTest, FeaturesUnderTheMaskOfMapOrDriveAreNotUsed) {
  cv::Mat left(240, 320, CV_8U, cv::Scalar(255));
  left.colRange(160, 320).setTo(0);
  MapHeader header = map()->header();
  header.sessions.front().mask = Mask(left);
  LocalizerConfig config = test::swarmConfig();
  config.features = "sift";
  Localizer localizer(std::make_shared<TrainingMap>(header, std::vector<TrainingImage>{map()->image(0)}), config);
  localizer.process(0, viewAt(0.3));
  const LocalFeatures left_half = localizer.lastLocal();
  ASSERT_FALSE(left_half.empty());
  for (const Keypoint& keypoint : left_half.keypoints()) EXPECT_LE(keypoint.x_px, 160.0F);
  cv::Mat right;
  cv::flip(left, right, 1);
  cv::resize(right, right, {640, 480}, 0.0, 0.0, cv::INTER_NEAREST);
  localizer.setMask(Mask(right));
  for (const double along_m : {5.3, 8.3}) {
    localizer.process(static_cast<std::int64_t>(along_m) * kSecond, viewAt(along_m));
    const LocalFeatures right_half = localizer.lastLocal();
    ASSERT_FALSE(right_half.empty());
    for (const Keypoint& keypoint : right_half.keypoints()) EXPECT_GE(keypoint.x_px, 159.0F);
    localizer.configure(config);  // which does not forget it
  }
}

}  // namespace
}  // namespace visual_localization

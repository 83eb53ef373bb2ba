#include "visual_localization/localizer/localizer.h"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "test/support/synthetic.h"
#include "visual_localization/features/pruning.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

constexpr int kPixelsPerImage = 20;
constexpr double kMetresPerImage = 0.6;
constexpr std::int64_t kSecond = 1000000000;

/// A street of 60 training images along a wall, and a camera that drives along it.
class LocalizerTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    wall_ = test::wall(60 * kPixelsPerImage + 320, 240, 21);
    const auto extractor = makeSiftExtractor(SiftConfig());
    std::vector<TrainingImage> images(60);
    std::vector<SiftFeatures> all;
    for (int i = 0; i < 60; ++i) all.push_back(extractor->extract(test::viewOf(wall_, i * kPixelsPerImage)));
    for (std::size_t i = 0; i < images.size(); ++i) {
      const auto& neighbour = all[i == 0 ? 1 : i - 1];
      images[i].stamp_ns = static_cast<std::int64_t>(i) * kSecond;
      images[i].position_m = {kMetresPerImage * static_cast<double>(i), 0.0};
      images[i].sift = keepSeenIn(all[i], {&neighbour}, 0.6);
    }
    MapHeader header;
    header.datum = {48.5, 9.0, 400.0};
    header.image_size = {320, 240};
    header.sessions = {"wall"};
    map_ = std::make_shared<TrainingMap>(header, std::move(images));
  }
  static void TearDownTestSuite() { map_.reset(); }

  /// What the camera sees at `metres` along the street.
  static cv::Mat viewAt(double metres) {
    return test::viewOf(wall_, static_cast<int>(metres / kMetresPerImage * kPixelsPerImage));
  }

  static inline cv::Mat wall_;
  static inline std::shared_ptr<const TrainingMap> map_;
};

TEST_F(LocalizerTest, TracksACameraAlongTheStreet) {
  Localizer localizer(map_, LocalizerConfig());
  Estimate estimate;
  for (int i = 0; i < 40; ++i) {
    estimate = localizer.process(i * kSecond, viewAt(0.5 * i + 0.3));
    EXPECT_EQ(estimate.stamp_ns, i * kSecond);
  }
  EXPECT_EQ(estimate.state, LocalizationState::kTracking);
  EXPECT_NEAR(estimate.pose.position_m.x(), 0.5 * 39 + 0.3, 1.5);
  EXPECT_GT(estimate.best.similarity, 0.2);
  EXPECT_LE(estimate.features_kept, estimate.features_extracted);
  EXPECT_GE(estimate.pose.covariance_m2(0, 0), 0.25);
  const Eigen::Vector2d geodetic = map_->frame().toEastNorth(estimate.pose.geodetic);
  EXPECT_LT((geodetic - estimate.pose.position_m).norm(), 1e-6);
}

TEST_F(LocalizerTest, TheSameSeedGivesTheSameTrack) {
  Localizer first(map_, LocalizerConfig());
  Localizer second(map_, LocalizerConfig());
  for (int i = 0; i < 10; ++i) {
    const cv::Mat view = viewAt(0.5 * i);
    EXPECT_EQ(first.process(i * kSecond, view).pose.position_m, second.process(i * kSecond, view).pose.position_m);
  }
}

TEST_F(LocalizerTest, FogIsNeverATrackedPosition) {
  Localizer localizer(map_, LocalizerConfig());
  const cv::Mat fog(240, 320, CV_8UC1, cv::Scalar(90));
  for (int i = 0; i < 20; ++i) {
    const Estimate estimate = localizer.process(i * kSecond, fog);
    EXPECT_NE(estimate.state, LocalizationState::kTracking);
    EXPECT_TRUE(estimate.pose.position_m.allFinite());
    EXPECT_TRUE(estimate.pose.covariance_m2.allFinite());
  }
}

TEST_F(LocalizerTest, AnotherPlaceIsNeverATrackedPosition) {
  Localizer localizer(map_, LocalizerConfig());
  const cv::Mat elsewhere = test::wall(1000, 240, 99);
  for (int i = 0; i < 30; ++i) {
    EXPECT_NE(localizer.process(i * kSecond, test::viewOf(elsewhere, 15 * i)).state, LocalizationState::kTracking);
  }
}

TEST_F(LocalizerTest, RelocalizeForgetsAndFindsAgain) {
  Localizer localizer(map_, LocalizerConfig());
  for (int i = 0; i < 20; ++i) localizer.process(i * kSecond, viewAt(5.0));
  localizer.relocalize(around({30.0, 0.0}, 3.0));
  const Estimate first = localizer.process(20 * kSecond, viewAt(30.0));
  EXPECT_EQ(first.state, LocalizationState::kInitializing);
  EXPECT_NEAR(first.pose.position_m.x(), 30.0, 3.0);
  Estimate last = first;
  for (int i = 21; i < 40; ++i) last = localizer.process(i * kSecond, viewAt(30.0));
  EXPECT_EQ(last.state, LocalizationState::kTracking);
  EXPECT_NEAR(last.pose.position_m.x(), 30.0, 1.5);
}

TEST_F(LocalizerTest, OtherSizesAreResizedToTheMaps) {
  Localizer localizer(map_, LocalizerConfig());
  cv::Mat large;
  Estimate estimate;
  for (int i = 0; i < 30; ++i) {
    cv::resize(viewAt(10.0), large, cv::Size(640, 480), 0, 0, cv::INTER_CUBIC);
    estimate = localizer.process(i * kSecond, large);
  }
  EXPECT_EQ(estimate.state, LocalizationState::kTracking);
  EXPECT_NEAR(estimate.pose.position_m.x(), 10.0, 1.5);
}

TEST_F(LocalizerTest, RefusesABadImageAndGoesOn) {
  Localizer localizer(map_, LocalizerConfig());
  EXPECT_THROW(localizer.process(0, cv::Mat()), std::invalid_argument);
  EXPECT_THROW(localizer.process(0, cv::Mat(240, 320, CV_8UC3)), std::invalid_argument);
  EXPECT_THROW(localizer.process(0, cv::Mat(4, 4, CV_8UC1)), std::invalid_argument);
  EXPECT_NO_THROW(localizer.process(0, viewAt(10.0)));
}

TEST_F(LocalizerTest, RefusesABadConfiguration) {
  LocalizerConfig config;
  config.dpso.particles = 0;
  EXPECT_THROW(Localizer(map_, config), ParameterError);
  config = LocalizerConfig();
  config.tracker = "crystal_ball";
  EXPECT_THROW(Localizer(map_, config), ParameterError);
}

TEST_F(LocalizerTest, OnlyAnImageThatFollowsIsPruned) {
  FrontEnd front_end(SiftConfig(), MatchConfig(), {320, 240}, true, 5.0);
  const auto pruned = [&](std::int64_t stamp_ns) {
    front_end.setImage(stamp_ns, viewAt(10.0 + 1e-9 * static_cast<double>(stamp_ns)));
    return front_end.sift().size() < front_end.siftExtracted();
  };
  EXPECT_FALSE(pruned(0)) << "the first image has none before it";
  EXPECT_TRUE(pruned(1 * kSecond));
  EXPECT_FALSE(pruned(7 * kSecond)) << "after a gap";
  EXPECT_TRUE(pruned(8 * kSecond));
  EXPECT_FALSE(pruned(8 * kSecond)) << "a stamp that stands still";
  EXPECT_FALSE(pruned(2 * kSecond)) << "a stamp that goes back";
  front_end.setImage(3 * kSecond, cv::Mat(240, 320, CV_8UC1, cv::Scalar(0)));
  EXPECT_FALSE(pruned(4 * kSecond)) << "the image before was black";
}

}  // namespace
}  // namespace visual_localization

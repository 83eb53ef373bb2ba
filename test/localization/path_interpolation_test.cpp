#include "visual_localization/localization/path_interpolation.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "visual_localization/localization/scores.h"

namespace visual_localization {
namespace {

constexpr std::size_t kImages = 20;

/// A street to the east with an image a metre, and an image of it whose features look larger by 5 % for each metre that
/// a training image is behind.
class PathInterpolation : public ::testing::Test {
 protected:
  PathInterpolation() {
    for (std::size_t i = 0; i < kImages; ++i) images_[i].position_m = {static_cast<double>(i), 0.0};
  }

  Eigen::Vector2d from(std::size_t image, double along_m) {
    const TrainingMap map({{48.5, 9.0, 400.0}, {320, 240}, {}, {{"monday"}, {"tuesday"}}}, images_);
    scores_.startImage(FeatureKind::kLocal, [this, along_m, &map](FeatureKind, std::size_t i) {
      asked_.push_back(i);
      Score score{0.5, 0.5, 20, true, std::exp(0.05 * (along_m - map.position_m(i).x()))};
      if (i == unrecognised_) score.recognised = false;
      if (i == few_matches_) score.matches = 7;
      return score;
    });
    return interpolateOnPath(map, scores_, image);
  }

  std::vector<TrainingImage> images_{kImages};
  Scores scores_{kImages};
  std::vector<std::size_t> asked_;
  std::size_t unrecognised_ = kImages;
  std::size_t few_matches_ = kImages;
};

TEST_F(PathInterpolation, FindsThePositionBetweenTwoImages) {
  EXPECT_NEAR(from(8, 8.3).x(), 8.3, 1e-9);
  EXPECT_EQ(asked_, (std::vector<std::size_t>{8, 9}));
  EXPECT_NEAR(from(8, 7.6).x(), 7.6, 1e-9);
  EXPECT_NEAR(from(8, 8.0).x(), 8.0, 1e-9);
}

TEST_F(PathInterpolation, WalksAlongThePath) {
  EXPECT_NEAR(from(8, 12.4).x(), 12.4, 1e-9);
  EXPECT_NEAR(from(8, 3.7).x(), 3.7, 1e-9);
  asked_.clear();
  EXPECT_NEAR(from(2, 19.0).x(), 12.0, 1e-9) << "not for ever";
  EXPECT_EQ(asked_.size(), 11U);
}

TEST_F(PathInterpolation, StaysWithinTheMap) {
  EXPECT_NEAR(from(19, 21.0).x(), 19.0, 1e-9);
  EXPECT_NEAR(from(0, -2.0).x(), 0.0, 1e-9);
}

TEST_F(PathInterpolation, EndsBeforeAnImageThatSaysNothing) {
  unrecognised_ = 10;
  EXPECT_NEAR(from(8, 12.4).x(), 9.0, 1e-9);
  unrecognised_ = kImages;
  few_matches_ = 9;
  EXPECT_NEAR(from(8, 12.4).x(), 8.0, 1e-9);
  few_matches_ = 8;
  EXPECT_NEAR(from(8, 12.4).x(), 8.0, 1e-9) << "and there is no side to go to";
}

TEST_F(PathInterpolation, StaysOnThePathOfOneSession) {
  for (std::size_t i = 10; i < kImages; ++i) images_[i].session = 1;
  EXPECT_NEAR(from(8, 12.4).x(), 9.0, 1e-9);
  EXPECT_NEAR(from(11, 8.0).x(), 10.0, 1e-9);
}

TEST_F(PathInterpolation, DoesNotCrossAGap) {
  for (std::size_t i = 10; i < kImages; ++i) images_[i].position_m.x() += 10.0;
  EXPECT_NEAR(from(8, 12.4).x(), 9.0, 1e-9);
}

}  // namespace
}  // namespace visual_localization

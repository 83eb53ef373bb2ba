#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "test/support/refusal.h"
#include "test/support/synthetic.h"
#include "visual_localization/features/feature_matcher.h"
#include "visual_localization/features/local_features.h"
#include "visual_localization/features/sift.h"

namespace visual_localization {
namespace {

TEST(LocalExtractor, AShiftedImageShowsTheSameFeaturesShifted) {
  const cv::Mat wall = test::wall(400, 240, 5);
  const auto extractor = makeSiftExtractor(SiftConfig());
  const LocalFeatures here = extractor->extract(test::viewOf(wall, 0));
  const LocalFeatures there = extractor->extract(test::viewOf(wall, 16));
  const auto matches = matchSymmetric(here, there, 0.6);
  ASSERT_GT(matches.size(), 100u);
  std::size_t shifted = 0;
  for (const FeatureMatch& match : matches) {
    const Keypoint& a = here.keypoints()[match.a];
    const Keypoint& b = there.keypoints()[match.b];
    if (std::abs(a.x_px - b.x_px - 16.0F) < 1.0F && std::abs(a.y_px - b.y_px) < 1.0F) ++shifted;
  }
  EXPECT_GT(static_cast<double>(shifted), 0.95 * static_cast<double>(matches.size()));
}

TEST(LocalExtractor, BrighterIsTheSame) {
  const cv::Mat image = test::viewOf(test::wall(320, 240, 6), 0);
  cv::Mat brighter;
  image.convertTo(brighter, CV_8UC1, 0.7, 60.0);
  const auto extractor = makeSiftExtractor(SiftConfig());
  const LocalFeatures a = extractor->extract(image);
  const auto matches = matchSymmetric(a, extractor->extract(brighter), 0.6);
  EXPECT_GT(static_cast<double>(matches.size()), 0.5 * static_cast<double>(a.size()));
}

TEST(LocalExtractor, GivesTheSameTwice) {
  const cv::Mat image = test::viewOf(test::wall(320, 240, 7), 0);
  const auto extractor = makeSiftExtractor(SiftConfig());
  const LocalFeatures first = extractor->extract(image);
  EXPECT_EQ(first.bytes(), extractor->extract(image).bytes());
  EXPECT_EQ(first.bytes(), makeSiftExtractor(SiftConfig())->extract(image).bytes());
}

TEST(LocalExtractor, AnEmptySceneHasNoFeatures) {
  const cv::Mat fog(240, 320, CV_8UC1, cv::Scalar(90));
  EXPECT_TRUE(makeSiftExtractor(SiftConfig())->extract(fog).empty());
}

TEST(LocalExtractor, HonoursTheLargestNumberOfFeatures) {
  SiftConfig config;
  config.max_features = 50;
  const LocalFeatures features = makeSiftExtractor(config)->extract(test::viewOf(test::wall(320, 240, 8), 0));
  EXPECT_LE(features.size(), 60u);  // OpenCV keeps ties of strength
  EXPECT_GE(features.size(), 40u);
}

TEST(LocalExtractor, TakesTheSmallestImageAndNoneSmaller) {
  EXPECT_TRUE(isExtractable(cv::Mat(kSmallestImageSide_px, kSmallestImageSide_px, CV_8UC1, cv::Scalar(0))));
  EXPECT_FALSE(isExtractable(cv::Mat(kSmallestImageSide_px - 1, 320, CV_8UC1)));
  EXPECT_FALSE(isExtractable(cv::Mat(320, kSmallestImageSide_px - 1, CV_8UC1)));
  EXPECT_FALSE(isExtractable(cv::Mat(320, 240, CV_8UC3)));
  EXPECT_NO_THROW(makeSiftExtractor(SiftConfig())->extract(cv::Mat(16, 16, CV_8UC1, cv::Scalar(0))));
  EXPECT_EQ(test::refusalOf<std::invalid_argument>([&] { requireExtractable(cv::Mat(15, 320, CV_8UC1)); }),
            "image is 320x15 pixels, must be at least 16x16");
}

TEST(LocalExtractor, RefusesWhatIsNoGreyImage) {
  const auto extractor = makeSiftExtractor(SiftConfig());
  EXPECT_THROW(extractor->extract(cv::Mat()), std::invalid_argument);
  EXPECT_THROW(extractor->extract(cv::Mat(240, 320, CV_8UC3)), std::invalid_argument);
  EXPECT_THROW(extractor->extract(cv::Mat(240, 320, CV_16UC1)), std::invalid_argument);
  EXPECT_THROW(extractor->extract(cv::Mat(8, 320, CV_8UC1)), std::invalid_argument);
}

}  // namespace
}  // namespace visual_localization

#include "node/matches_image.h"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "test/node/small_map.h"

namespace visual_localization {
namespace {

/// Pixels of the left half that are not grey: where something is drawn.
int colouredPixels(const cv::Mat& canvas) {
  cv::Mat channels[3];
  cv::split(canvas(cv::Rect(0, 0, canvas.cols / 2, canvas.rows)), channels);
  return cv::countNonZero(channels[0] != channels[2]);
}

TEST(MatchesImage, ShowsBothImagesSideBySide) {
  const cv::Mat canvas = drawMatches(cv::Mat(240, 320, CV_8UC1, cv::Scalar(100)), {}, *test::smallMap(), 0, 0.6);
  EXPECT_EQ(canvas.type(), CV_8UC3);
  EXPECT_EQ(canvas.rows, 360);
  EXPECT_EQ(canvas.cols, 960);
  EXPECT_EQ(colouredPixels(canvas), 0);
}

TEST(MatchesImage, JoinsMatchedFeatures) {
  const auto map = test::smallMap();
  const cv::Mat grey(480, 640, CV_8UC1, cv::Scalar(100));
  EXPECT_GT(colouredPixels(drawMatches(grey, *map->sift(3), *map, 3, 0.6)), 1000);
  EXPECT_EQ(colouredPixels(drawMatches(grey, test::randomFeatures(99, 40), *map, 3, 0.6)), 0);
}

}  // namespace
}  // namespace visual_localization

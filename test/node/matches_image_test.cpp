#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "node/drawings.h"
#include "test/node/small_map.h"
#include "visual_localization/features/sift.h"

namespace visual_localization {
namespace {

/// Where something is drawn.
int colouredPixels(const cv::Mat& canvas, const cv::Rect& area) {
  cv::Mat channels[3];
  cv::split(canvas(area & cv::Rect({}, canvas.size())), channels);
  return cv::countNonZero(channels[0] != channels[2]);
}

int colouredPixels(const cv::Mat& canvas) { return colouredPixels(canvas, {0, 0, canvas.cols / 2, canvas.rows}); }

TEST(MatchesImage, ShowsBothImagesSideBySide) {
  const cv::Mat canvas = drawMatches(cv::Mat(240, 320, CV_8UC1, cv::Scalar(100)), {}, *test::smallMap(), 0, {});
  EXPECT_EQ(canvas.type(), CV_8UC3);
  EXPECT_EQ(canvas.rows, 360);
  EXPECT_EQ(canvas.cols, 960);
  EXPECT_EQ(colouredPixels(canvas), 0);
}

cv::Mat drawnBesidePreview(const std::vector<std::uint8_t>& preview, const cv::Size& size) {
  MapHeader header;
  header.image_size = size;
  header.sessions = {{"session"}};
  TrainingImage image;
  image.preview_jpeg = preview;
  return drawMatches(cv::Mat(size, CV_8UC1, cv::Scalar(100)), {}, {header, {image}}, 0, {});
}

TEST(MatchesImage, APreviewThatIsTooLargeOrBrokenIsNotShown) {
  std::vector<std::uint8_t> huge;
  cv::imencode(".jpg", cv::Mat(4097, 4096, CV_8UC1, cv::Scalar(200)), huge);
  for (const auto& preview : {huge, std::vector<std::uint8_t>{0xFF, 0xD8, 0xFF}}) {
    const cv::Mat canvas = drawnBesidePreview(preview, {320, 240});
    EXPECT_EQ(canvas.at<cv::Vec3b>(180, 240), cv::Vec3b::all(100));
    EXPECT_EQ(canvas.at<cv::Vec3b>(180, 720), cv::Vec3b::all(48));
  }
}

TEST(MatchesImage, AThinImageIsNotEnlargedWithoutEnd) {
  const cv::Mat canvas = drawnBesidePreview({}, {16, 16384});
  EXPECT_LE(canvas.total(), std::size_t{40'000'000});
}

TEST(MatchesImage, JoinsMatchedFeatures) {
  const auto map = test::smallMap();
  const cv::Mat grey(480, 640, CV_8UC1, cv::Scalar(100));
  EXPECT_GT(colouredPixels(drawMatches(grey, *map->local(3), *map, 3, {})), 1000);
  EXPECT_EQ(colouredPixels(drawMatches(grey, test::randomFeatures(99, 40), *map, 3, {})), 0);
}

/// The first of `features` and a twin of it half an image away, whose nearest neighbour among them is that one too.
LocalFeatures firstAndItsTwin(const LocalFeatures& features) {
  Keypoint twin = features.keypoints()[0];
  twin.y_px += twin.y_px < 120.0F ? 120.0F : -120.0F;
  std::vector<std::uint8_t> descriptors;
  for (int i = 0; i < 2; ++i) {
    descriptors.insert(descriptors.end(), features.bytes(0), features.bytes(0) + kSiftDimension);
  }
  descriptors.back() ^= 1U;
  return LocalFeatures({features.keypoints()[0], twin}, std::move(descriptors));
}

/// Whether something is drawn around feature `i` of the current image.
bool isJoined(const cv::Mat& canvas, const LocalFeatures& sift, std::size_t i) {
  constexpr double kScale = 1.5;
  const Keypoint& keypoint = sift.keypoints()[i];
  const cv::Point centre(cvRound(keypoint.x_px * kScale), cvRound(keypoint.y_px * kScale));
  const cv::Rect around(centre - cv::Point(8, 8), cv::Size(17, 17));
  return colouredPixels(canvas, around) > 0;
}

TEST(MatchesImage, DrawsTheMatchesOfTheMode) {
  const auto map = test::smallMap();
  const cv::Mat grey(240, 320, CV_8UC1, cv::Scalar(100));
  const LocalFeatures sift = firstAndItsTwin(*map->local(3));
  const cv::Mat symmetric = drawMatches(grey, sift, *map, 3, {0.6, "symmetric"});
  EXPECT_TRUE(isJoined(symmetric, sift, 0));
  EXPECT_FALSE(isJoined(symmetric, sift, 1)) << "the training feature is nearer to the first";
  const cv::Mat one_way = drawMatches(grey, sift, *map, 3, {0.6, "one_way"});
  EXPECT_TRUE(isJoined(one_way, sift, 0));
  EXPECT_TRUE(isJoined(one_way, sift, 1));
}

/// Clearly more of one channel than of the other.
int pixelsMoreOf(const cv::Mat& canvas, int channel, int than) {
  cv::Mat channels[3];
  cv::split(canvas, channels);
  return cv::countNonZero(channels[channel] > channels[than] + 60);
}
int greenPixels(const cv::Mat& canvas) { return pixelsMoreOf(canvas, 1, 2); }
int redPixels(const cv::Mat& canvas) { return pixelsMoreOf(canvas, 2, 1); }

MatchedLandmarks matchedIn(const TrainingMap& map, std::size_t training, bool inlier) {
  MatchedLandmarks matched{training, {}};
  for (std::uint32_t i = 0; i < 10; ++i) {
    const Keypoint& keypoint = map.local(training)->keypoints()[i];
    matched.landmarks.push_back({{keypoint.x_px, keypoint.y_px}, i, inlier});
  }
  return matched;
}

TEST(MatchesImage, LandmarksAreGreenWhenTheyAgreeAndRedWhenNot) {
  const auto map = test::smallMap();
  const cv::Mat grey(240, 320, CV_8UC1, cv::Scalar(100));
  const cv::Mat agreeing = drawLandmarks(grey, matchedIn(*map, 3, true), *map);
  EXPECT_EQ(agreeing.size(), cv::Size(960, 360));
  EXPECT_GT(greenPixels(agreeing), 500);
  EXPECT_EQ(redPixels(agreeing), 0);
  const cv::Mat contradicting = drawLandmarks(grey, matchedIn(*map, 3, false), *map);
  EXPECT_GT(redPixels(contradicting), 500);
  EXPECT_EQ(greenPixels(contradicting), 0);
}

TEST(MatchesImage, LandmarksWhoseFeatureCannotBeReadAreNotDrawn) {
  const auto map = test::smallMap();
  MatchedLandmarks matched = matchedIn(*map, 3, true);
  for (MatchedLandmark& landmark : matched.landmarks) landmark.training_feature += 1000;
  const cv::Mat canvas = drawLandmarks(cv::Mat(240, 320, CV_8UC1, cv::Scalar(100)), matched, *map);
  EXPECT_EQ(colouredPixels(canvas, {{}, canvas.size()}), 0);
}

}  // namespace
}  // namespace visual_localization

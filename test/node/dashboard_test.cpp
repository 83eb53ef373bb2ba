#include <limits>

#include <gtest/gtest.h>

#include "node/drawings.h"

namespace visual_localization {
namespace {

LocalizationStatus statusOf(std::uint8_t state, double similarity = 0.2) {
  LocalizationStatus status;
  status.state = state;
  status.state_name = "STATE";
  status.best_image = 3;
  status.best_similarity = similarity;
  status.probability = 0.99;
  status.min_probability = 0.97;
  status.latency_ms = 20.0;
  return status;
}

/// Within `area`.
int pixelsOf(const cv::Mat& picture, std::uint8_t state, const cv::Rect& area) {
  cv::Mat same;
  cv::inRange(picture(area), colourOfState(state), colourOfState(state), same);
  return cv::countNonZero(same);
}

cv::Rect topOf(const cv::Mat& picture) { return {0, 0, picture.cols, picture.rows / 6}; }
cv::Rect bottomOf(const cv::Mat& picture) { return {0, 5 * picture.rows / 6, picture.cols, picture.rows / 6}; }

TEST(Dashboard, IsDarkAndOfTheSameSizeWithoutAnImage) {
  Dashboard dashboard;
  const cv::Mat empty = dashboard.draw();
  EXPECT_EQ(empty.type(), CV_8UC3);
  dashboard.add(statusOf(LocalizationStatus::TRACKING));
  EXPECT_EQ(dashboard.draw().size(), empty.size());
}

TEST(Dashboard, BearsTheColourOfTheNewestState) {
  Dashboard dashboard;
  for (const std::uint8_t state :
       {LocalizationStatus::NO_MAP, LocalizationStatus::INITIALIZING, LocalizationStatus::TRACKING,
        LocalizationStatus::UNCERTAIN, LocalizationStatus::RECOVERING, LocalizationStatus::OFF_MAP}) {
    dashboard.add(statusOf(state));
    const cv::Mat picture = dashboard.draw();
    EXPECT_GT(pixelsOf(picture, state, topOf(picture)), topOf(picture).area() / 2) << static_cast<int>(state);
  }
}

TEST(Dashboard, ShowsNoFiguresOfAStatusThatAnswersNoImage) {
  Dashboard dashboard;
  LocalizationStatus status = statusOf(LocalizationStatus::UNCERTAIN);
  status.best_image = -1;
  dashboard.add(status);
  const cv::Mat silent = dashboard.draw();
  status.comparisons = 77777;
  Dashboard other;
  other.add(status);
  const cv::Mat left_half = other.draw()(cv::Rect(0, 0, silent.cols / 2, silent.rows));
  EXPECT_EQ(cv::norm(left_half, silent(cv::Rect(0, 0, silent.cols / 2, silent.rows))), 0.0);
}

TEST(Dashboard, ShowsWhatThePoseRestsOn) {
  Dashboard place;
  Dashboard metric;
  LocalizationStatus status = statusOf(LocalizationStatus::TRACKING);
  status.source_name = "PLACE";
  place.add(status);
  status.source = LocalizationStatus::METRIC;
  status.source_name = "METRIC";
  status.inliers = 120;
  metric.add(status);
  const cv::Mat first = place.draw();
  const cv::Rect row(0, first.rows / 6, first.cols / 2, first.rows / 3);  // below the header
  EXPECT_GT(cv::norm(first(row), metric.draw()(row)), 0.0);
}

TEST(Dashboard, SaysWhyAndShowsAProbabilityThatIsTooSmallAsBad) {
  LocalizationStatus status = statusOf(LocalizationStatus::UNCERTAIN);
  Dashboard plain;
  plain.add(status);
  status.reason.sentence = "Another place of the map looks as much like the images, at x = 80 m, y = 3 m (0.45)";
  Dashboard explained;
  explained.add(status);
  const cv::Mat without = plain.draw();
  const cv::Mat with = explained.draw();
  EXPECT_GT(cv::norm(without(topOf(without)), with(topOf(with))), 0.0);
  status.probability = 0.5;
  Dashboard doubtful;
  doubtful.add(status);
  const cv::Mat picture = doubtful.draw();
  const cv::Rect row(0, 100, picture.cols / 2, 48);  // the first below the header
  const auto reddish = [&row](const cv::Mat& canvas) {
    cv::Mat same;
    cv::inRange(canvas(row), cv::Scalar(80, 140, 245), cv::Scalar(100, 160, 255), same);
    return cv::countNonZero(same);
  };
  EXPECT_EQ(reddish(with), 0);
  EXPECT_GT(reddish(picture), 0);
}

TEST(Dashboard, AnOldPictureIsGreyAndSaysWhy) {
  const cv::Mat colour(200, 400, CV_8UC3, cv::Scalar(250, 100, 20));
  const cv::Mat plain = greyedOut(colour, "");
  const cv::Vec3b pixel = plain.at<cv::Vec3b>(10, 10);
  EXPECT_EQ(pixel[0], pixel[2]);
  EXPECT_LT(pixel[0], 100);
  EXPECT_GT(cv::norm(plain, greyedOut(colour, "No image comes")), 0.0);
}

TEST(Dashboard, StatesDifferInColour) {
  for (std::uint8_t a = 0; a < 6; ++a) {
    for (std::uint8_t b = 0; b < a; ++b) EXPECT_GT(cv::norm(colourOfState(a), colourOfState(b)), 40.0);
  }
}

TEST(Dashboard, RemembersTheLastImagesOnly) {
  Dashboard dashboard;
  dashboard.add(statusOf(LocalizationStatus::RECOVERING));
  for (std::size_t i = 1; i < Dashboard::kShown; ++i) dashboard.add(statusOf(LocalizationStatus::TRACKING));
  cv::Mat picture = dashboard.draw();
  EXPECT_GT(pixelsOf(picture, LocalizationStatus::RECOVERING, bottomOf(picture)), 0);
  dashboard.add(statusOf(LocalizationStatus::TRACKING));
  picture = dashboard.draw();
  EXPECT_EQ(pixelsOf(picture, LocalizationStatus::RECOVERING, bottomOf(picture)), 0);
}

TEST(Dashboard, ShowsOddFiguresWithoutFailing) {
  Dashboard dashboard;
  LocalizationStatus status = statusOf(LocalizationStatus::TRACKING, 0.0);
  for (const double odd :
       {-1.0, 0.0, 1e300, -1e300, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    status.sigma_position = status.sigma_heading = odd;
    status.latency_ms = status.probability = status.best_similarity = status.min_probability = status.off_map = odd;
    status.comparisons = std::numeric_limits<std::uint32_t>::max();
    dashboard.add(status);
    EXPECT_NO_THROW(dashboard.draw());
  }
}

}  // namespace
}  // namespace visual_localization

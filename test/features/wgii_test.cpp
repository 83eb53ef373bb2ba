#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "base/numbers.h"
#include "features/global_histograms.h"
#include "test/support/pixel_place.h"
#include "test/support/synthetic.h"

namespace visual_localization {
namespace {

using Histogram = GlobalFeatures::Histogram;
using Sums = std::array<double, GlobalFeatures::kSize>;

void add(Sums& histogram, cv::Size size, cv::Point at, std::size_t bin) {
  const test::PixelPlace column(at.x, size.width, 0.25);
  const test::PixelPlace row(at.y, size.height, 0.25);
  histogram[(row.subimage * 4 + column.subimage) * 8 + bin] += column.weight * row.weight;
}

/// Intensity between the pixels, in [0, 1]; beyond the border that of the nearest pixel.
double intensity(const cv::Mat& grey, double x, double y) {
  const auto level = [&grey](double column, double row) {
    const int i = std::clamp(static_cast<int>(row), 0, grey.rows - 1);
    return grey.at<std::uint8_t>(i, std::clamp(static_cast<int>(column), 0, grey.cols - 1)) / 255.0;
  };
  const double left = std::floor(x);
  const double top = std::floor(y);
  const double upper = level(left, top) + (x - left) * (level(left + 1, top) - level(left, top));
  const double lower = level(left, top + 1) + (x - left) * (level(left + 1, top + 1) - level(left, top + 1));
  return upper + (y - top) * (lower - upper);
}

double invariant(const cv::Mat& grey, cv::Point at) {
  double sum = 0.0;
  for (int k = 0; k < 10; ++k) {
    const double c = std::cos(2.0 * kPi * k / 10.0);
    const double s = std::sin(2.0 * kPi * k / 10.0);
    const double difference = intensity(grey, at.x + 10.0 * c, at.y + 10.0 * s) -  //
                              intensity(grey, at.x - 20.0 * s, at.y + 20.0 * c);
    sum += std::clamp(0.5 - difference / (2.0 * 0.098), 0.0, 1.0);
  }
  return sum / 10.0;
}

/// The histogram of the plain formula: at least `least`, at most `most`, for invariants up to 0.001 too large.
struct Bounds {
  explicit Bounds(const cv::Mat& grey) {
    const int margin_px = std::min(grey.cols, grey.rows) < 160 ? 0 : 20;
    for (int y = margin_px; y < grey.rows - margin_px; ++y) {
      for (int x = margin_px; x < grey.cols - margin_px; ++x) {
        const double value = invariant(grey, {x, y});
        const auto bin = static_cast<std::size_t>(std::min(7.0, 8.0 * (value + 1e-12)));
        const auto next = static_cast<std::size_t>(std::min(7.0, 8.0 * (value + 0.001)));
        if (bin == next) add(least, grey.size(), {x, y}, bin);
        add(most, grey.size(), {x, y}, bin);
        if (bin != next) add(most, grey.size(), {x, y}, next);
      }
    }
  }
  Sums least{};
  Sums most{};
};

void expectWithinBounds(Wgii& wgii, const cv::Mat& image) {
  const Histogram histogram = wgii.extract(image);
  const Bounds bounds(image);
  for (std::size_t i = 0; i < histogram.size(); ++i) {
    EXPECT_GE(histogram[i], bounds.least[i] - 1e-5 * bounds.least[i]) << image.size() << " entry " << i;
    EXPECT_LE(histogram[i], bounds.most[i] + 1e-5 * bounds.most[i]) << image.size() << " entry " << i;
  }
}

/// Everything in the bin of 0.5.
void expectIndifferent(const cv::Mat& image) {
  const Histogram histogram = Wgii().extract(image);
  for (std::size_t i = 0; i < histogram.size(); ++i) EXPECT_EQ(histogram[i] > 0.0F, i % 8 == 4) << i;
}

TEST(Wgii, PlainImagesAreIndifferent) {
  for (const int level : {0, 1, 77, 255}) {
    expectIndifferent(cv::Mat(240, 320, CV_8UC1, cv::Scalar(level)));
    expectIndifferent(cv::Mat(16, 16, CV_8UC1, cv::Scalar(level)));
  }
}

// Opposite samples cancel out, however the rounding falls.
TEST(Wgii, EvenSlopesAreIndifferent) {
  cv::Mat right(180, 200, CV_8UC1);
  for (int x = 0; x < right.cols; ++x) right.col(x).setTo(x);
  cv::Mat left;
  cv::flip(right, left, 1);
  for (const cv::Mat& image : {right, left, cv::Mat(right.t()), cv::Mat(left.t())}) expectIndifferent(image);
}

/// Where a sample at `offset_px`, in any of the four quadrants, sees the spot at (100, 100): four pixels each.
void addQuadrants(Sums& histogram, const std::vector<int>& columns, const std::vector<int>& rows) {
  for (const int x : columns) {
    for (const int y : rows) {
      for (const int x_sign : {-1, 1}) {
        for (const int y_sign : {-1, 1}) {
          add(histogram, {160, 160}, {100 + x_sign * x, 100 + y_sign * y}, 3);
        }
      }
    }
  }
}

/// Of 160 x 160 pixels, all `background` but one.
void expectBelowHalf(int background, int spot, const Sums& expected) {
  cv::Mat image(160, 160, CV_8UC1, cv::Scalar(background));
  image.at<std::uint8_t>(100, 100) = static_cast<std::uint8_t>(spot);
  const Histogram histogram = Wgii().extract(image);
  for (std::size_t i = 0; i < histogram.size(); ++i) {
    if (i % 8 == 4) continue;  // the rest of the image
    EXPECT_NEAR(histogram[i], expected[i], 1e-5) << i;
  }
}

// One of the ten kernels is below 0.5 where p1 falls on the white spot, and none elsewhere.
TEST(Wgii, AWhiteSpotIsSeenTenPixelsAway) {
  Sums expected{};
  for (const int x : {90, 110}) add(expected, {160, 160}, {x, 100}, 3);
  addQuadrants(expected, {8, 9}, {5, 6});   // 10 cos 36 = 8.09, 10 sin 36 = 5.88
  addQuadrants(expected, {3, 4}, {9, 10});  // 10 cos 72 = 3.09, 10 sin 72 = 9.51
  expectBelowHalf(0, 255, expected);
}

TEST(Wgii, ABlackSpotIsSeenTwentyPixelsAway) {
  Sums expected{};
  for (const int y : {80, 120}) add(expected, {160, 160}, {100, y}, 3);
  addQuadrants(expected, {11, 12}, {16, 17});  // 20 sin 36 = 11.76, 20 cos 36 = 16.18
  addQuadrants(expected, {19, 20}, {6, 7});    // 20 sin 72 = 19.02, 20 cos 72 = 6.18
  expectBelowHalf(255, 0, expected);
}

TEST(Wgii, BrighterIsTheSameBitByBit) {
  for (const int width_px : {320, 90}) {
    const cv::Mat image = test::wall(width_px, 240, 3) / 3;
    EXPECT_EQ(Wgii().extract(image + 170), Wgii().extract(image));
  }
}

TEST(Wgii, AgreesWithThePlainFormula) {
  cv::RNG random(11);
  Wgii wgii;
  for (const cv::Size size : {cv::Size(320, 240), cv::Size(161, 173), cv::Size(160, 160), cv::Size(159, 160),
                              cv::Size(16, 16), cv::Size(17, 31), cv::Size(33, 200)}) {
    cv::Mat noise(size, CV_8UC1);
    random.fill(noise, cv::RNG::UNIFORM, 0, 256);
    expectWithinBounds(wgii, noise);
    cv::Mat soft;
    cv::GaussianBlur(noise, soft, cv::Size(), 4.0);
    expectWithinBounds(wgii, soft);
    expectWithinBounds(wgii, test::wall(size.width, size.height, 5));
  }
}

TEST(Wgii, APartOfALargerImageIsContinuedByItself) {
  const cv::Mat image = test::wall(300, 300, 6);
  const cv::Mat part = image(cv::Rect(100, 100, 60, 60));
  EXPECT_EQ(Wgii().extract(part), Wgii().extract(part.clone()));
}

}  // namespace
}  // namespace visual_localization

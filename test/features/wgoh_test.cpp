#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "features/global_histograms.h"
#include "test/support/pixel_place.h"
#include "test/support/synthetic.h"

namespace visual_localization {
namespace {

using Histogram = GlobalFeatures::Histogram;

std::array<double, GlobalFeatures::kSize> plainly(const cv::Mat& grey) {
  std::array<double, GlobalFeatures::kSize> histogram{};
  const auto level = [&grey](int x, int y) { return static_cast<double>(grey.at<std::uint8_t>(y, x)); };
  for (int y = 1; y + 1 < grey.rows; ++y) {
    for (int x = 1; x + 1 < grey.cols; ++x) {
      const double dx = level(x + 1, y) - level(x - 1, y);
      const double dy = level(x, y + 1) - level(x, y - 1);
      const auto bin = static_cast<std::size_t>(std::lround(std::atan2(dy, dx) / (kPi / 4.0)) + 8) % 8;
      const test::PixelPlace column(x, grey.cols, 0.5);
      const test::PixelPlace row(y, grey.rows, 0.5);
      histogram[(row.subimage * 4 + column.subimage) * 8 + bin] += std::hypot(dx, dy) * column.weight * row.weight;
    }
  }
  return histogram;
}

cv::Mat ramp(int x_slope, int y_slope) {
  cv::Mat image(44, 40, CV_8UC1);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(128 + x_slope * (x - 20) + y_slope * (y - 22));
    }
  }
  return image;
}

TEST(Wgoh, ARampHasOneOrientationInEverySubimage) {
  const std::vector<std::vector<int>> slopes_and_bin{
      {1, 0, 0},  {1, 1, 1},   {0, 1, 2}, {-1, 1, 3},  {-1, 0, 4},  {-1, -1, 5}, {0, -1, 6},
      {1, -1, 7}, {2, 1, 1},   {3, 1, 0}, {3, -1, 0},  {1, 3, 2},   {-1, 3, 2},  {-3, 1, 4},
      {-2, 1, 3}, {-3, -1, 4}, {1, 2, 1}, {-2, -1, 5}, {-1, -3, 6}, {1, -3, 6},  {2, -1, 7}};
  for (const auto& expected : slopes_and_bin) {
    const Histogram histogram = Wgoh().extract(ramp(expected[0], expected[1]));
    for (std::size_t i = 0; i < histogram.size(); ++i) {
      const bool filled = i % GlobalFeatures::kBins == static_cast<std::size_t>(expected[2]);
      EXPECT_EQ(histogram[i] > 0.0F, filled) << "slopes " << expected[0] << ", " << expected[1] << ", entry " << i;
    }
  }
}

TEST(Wgoh, APlainImageHasNoGradients) {
  EXPECT_EQ(Wgoh().extract(cv::Mat(48, 64, CV_8UC1, cv::Scalar(200))), Histogram{});
}

TEST(Wgoh, ASpotPointsAtItselfFromFourSides) {
  cv::Mat image(16, 16, CV_8UC1, cv::Scalar(0));
  image.at<std::uint8_t>(6, 5) = 100;
  // Subimages of 4 pixels, a standard deviation of 2: the spot's neighbours are 0.5 or 1.5 pixels from the centre.
  const double near = std::exp(-0.5 * 0.25 * 0.25);
  const double far = std::exp(-0.5 * 0.75 * 0.75);
  Histogram expected{};
  constexpr std::size_t kSubimage = 5 * GlobalFeatures::kBins;        // second row, second column
  expected[kSubimage + 0] = static_cast<float>(100.0 * far * near);   // at (4, 6)
  expected[kSubimage + 4] = static_cast<float>(100.0 * near * near);  // at (6, 6)
  expected[kSubimage + 2] = static_cast<float>(100.0 * near * near);  // at (5, 5)
  expected[kSubimage + 6] = static_cast<float>(100.0 * near * far);   // at (5, 7)
  const Histogram histogram = Wgoh().extract(image);
  for (std::size_t i = 0; i < histogram.size(); ++i) EXPECT_NEAR(histogram[i], expected[i], 1e-3) << i;
}

TEST(Wgoh, BrighterIsTheSameAndContrastScales) {
  const cv::Mat image = test::viewOf(test::wall(320, 240, 3), 0) / 3;
  const Histogram histogram = Wgoh().extract(image);
  EXPECT_EQ(Wgoh().extract(image + 90), histogram);
  const Histogram contrasty = Wgoh().extract(image * 2);
  for (std::size_t i = 0; i < histogram.size(); ++i) EXPECT_FLOAT_EQ(contrasty[i], 2.0F * histogram[i]) << i;
}

TEST(Wgoh, AgreesWithThePlainFormula) {
  cv::RNG random(7);
  Wgoh wgoh;
  for (const cv::Size size : {cv::Size(320, 240), cv::Size(16, 16), cv::Size(17, 31), cv::Size(101, 64)}) {
    cv::Mat image(size, CV_8UC1);
    random.fill(image, cv::RNG::UNIFORM, 0, 256);
    const Histogram histogram = wgoh.extract(image);
    const auto expected = plainly(image);
    for (std::size_t i = 0; i < histogram.size(); ++i) {
      EXPECT_NEAR(histogram[i], expected[i], 1e-5 * expected[i]) << size << " entry " << i;
    }
  }
}

}  // namespace
}  // namespace visual_localization

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "features/sift/scale_space.h"

namespace visual_localization {
namespace {

FloatPlane noisePlane(int width, int height, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> grey(0.0F, 255.0F);
  FloatPlane plane;
  plane.resize(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) plane.row(y)[x] = grey(random);
  }
  return plane;
}

/// The definition, in two dimensions at once.
double blurredAt(const FloatPlane& plane, const GaussianKernel& kernel, int column, int row) {
  double sum = 0.0;
  for (int j = -kernel.radius(); j <= kernel.radius(); ++j) {
    const float* pixels = plane.row(mirrored(row + j, plane.height()));
    for (int i = -kernel.radius(); i <= kernel.radius(); ++i) {
      const double weight = static_cast<double>(kernel.weights[static_cast<std::size_t>(std::abs(i))]) *
                            static_cast<double>(kernel.weights[static_cast<std::size_t>(std::abs(j))]);
      sum += weight * static_cast<double>(pixels[mirrored(column + i, plane.width())]);
    }
  }
  return sum;
}

TEST(GaussianKernel, SumsToOneAndHasItsVariance) {
  for (const double sigma_px : {0.8, 1.2263, 1.6, 3.09, 10.0}) {
    const GaussianKernel kernel(sigma_px);
    double sum = kernel.weights[0];
    double variance = 0.0;
    for (int k = 1; k <= kernel.radius(); ++k) {
      const double weight = kernel.weights[static_cast<std::size_t>(k)];
      sum += 2.0 * weight;
      variance += 2.0 * weight * k * k;
    }
    EXPECT_NEAR(sum, 1.0, 1e-6);
    EXPECT_NEAR(variance, sigma_px * sigma_px, 0.02 * sigma_px * sigma_px) << sigma_px;
    EXPECT_NEAR(kernel.radius(), 4.0 * sigma_px, 1.0);
  }
}

TEST(Mirrored, DoesNotRepeatTheLastPixel) {
  EXPECT_EQ(mirrored(-1, 5), 1);
  EXPECT_EQ(mirrored(5, 5), 3);
  EXPECT_EQ(mirrored(3, 5), 3);
  EXPECT_EQ(mirrored(-7, 3), 1);
  EXPECT_EQ(mirrored(9, 1), 0);
}

TEST(GaussianBlur, IsTheDefinitionForEverySize) {
  GaussianBlur blur;
  FloatPlane blurred;
  for (const int width : {1, 2, 3, 15, 16, 17, 31, 33, 70}) {
    for (const int height : {1, 2, 5, 16, 17, 40}) {
      for (const double sigma_px : {1.2, 3.1}) {
        const FloatPlane plane = noisePlane(width, height, static_cast<std::uint32_t>(100 * width + height));
        const GaussianKernel kernel(sigma_px);
        blurred.resize(width, height);
        blur.blurRows(plane, kernel, 0, height, blurred);
        for (int y = 0; y < height; ++y) {
          for (int x = 0; x < width; ++x) {
            ASSERT_NEAR(static_cast<double>(blurred.row(y)[x]), blurredAt(plane, kernel, x, y), 1e-3)
                << width << "x" << height << " at " << x << ", " << y;
          }
        }
      }
    }
  }
}

TEST(GaussianBlur, StripsMakeTheSameImage) {
  const FloatPlane plane = noisePlane(50, 45, 3);
  const GaussianKernel kernel(2.0);
  GaussianBlur blur;
  FloatPlane at_once;
  FloatPlane in_strips;
  at_once.resize(50, 45);
  in_strips.resize(50, 45);
  blur.blurRows(plane, kernel, 0, 45, at_once);
  for (const auto& [first, last] : {std::pair(0, 7), std::pair(7, 8), std::pair(8, 40), std::pair(40, 45)}) {
    blur.blurRows(plane, kernel, first, last, in_strips);
  }
  for (int y = 0; y < 45; ++y) {
    for (int x = 0; x < 50; ++x) ASSERT_EQ(at_once.row(y)[x], in_strips.row(y)[x]) << x << ", " << y;
  }
}

}  // namespace
}  // namespace visual_localization

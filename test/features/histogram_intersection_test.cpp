#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "features/global_histograms.h"
#include "visual_localization/features/global_features.h"

namespace visual_localization {
namespace {

using Histogram = GlobalFeatures::Histogram;

Histogram randomHistogram(std::uint32_t seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<float> value(0.0F, 1.0F);
  Histogram histogram{};
  for (float& bin : histogram) bin = value(engine);
  return histogram;
}

TEST(HistogramIntersection, OfAKnownPair) {
  Histogram query{};
  Histogram training{};
  query[0] = 4.0F;
  query[17] = 1.0F;
  query[127] = 3.0F;
  training[0] = 1.0F;
  training[17] = 2.0F;
  training[127] = 3.0F;
  training[64] = 10.0F;
  EXPECT_DOUBLE_EQ(histogramIntersection(query, training), 5.0 / 8.0);
  EXPECT_DOUBLE_EQ(histogramIntersection(training, query), 5.0 / 16.0);  // Eq. 1 divides by the query's sum
}

TEST(HistogramIntersection, EveryBinCounts) {
  for (std::size_t i = 0; i < GlobalFeatures::kSize; ++i) {
    Histogram query{};
    query[i] = 2.0F;
    Histogram training{};
    training[i] = 0.5F;
    EXPECT_DOUBLE_EQ(histogramIntersection(query, training), 0.25) << i;
    training[i] = 0.0F;
    training[(i + 1) % GlobalFeatures::kSize] = 2.0F;
    EXPECT_EQ(histogramIntersection(query, training), 0.0) << i;
  }
}

TEST(HistogramIntersection, IsAShare) {
  for (std::uint32_t seed = 0; seed < 100; ++seed) {
    const Histogram query = randomHistogram(seed);
    const Histogram training = randomHistogram(seed + 1);
    const double similarity = histogramIntersection(query, training);
    EXPECT_GT(similarity, 0.0);
    EXPECT_LT(similarity, 1.0);
    EXPECT_EQ(histogramIntersection(query, query), 1.0);
  }
}

TEST(HistogramIntersection, AnEmptyQueryResemblesNothing) {
  const Histogram empty{};
  EXPECT_EQ(histogramIntersection(empty, randomHistogram(1)), 0.0);
  EXPECT_EQ(histogramIntersection(randomHistogram(1), empty), 0.0);
  EXPECT_EQ(histogramIntersection(empty, empty), 0.0);
}

TEST(Normalise, ScalesToSumOneUnlessThereIsNothing) {
  Histogram histogram{};
  normalise(histogram);
  EXPECT_EQ(histogram, Histogram{});
  histogram[3] = 1.0F;
  histogram[90] = 3.0F;
  normalise(histogram);
  EXPECT_EQ(histogram[3], 0.25F);
  EXPECT_EQ(histogram[90], 0.75F);
}

/// Where and how much the pixel (x, y) counts.
Histogram pixelOf(const SubimageGrid& grid, int width_px, int x, int y) {
  const std::vector<float> values(static_cast<std::size_t>(width_px), 1.0F);
  const std::vector<std::uint8_t> bins(static_cast<std::size_t>(width_px), 2);
  Histogram histogram{};
  grid.addRow(y, x, x + 1, values.data(), bins.data(), histogram);
  return histogram;
}

TEST(SubimageGrid, APixelCountsByItsDistanceFromTheCentreOfItsSubimage) {
  const SubimageGrid grid({40, 80}, 0.5);  // subimages of 10 x 20 pixels
  const Histogram histogram = pixelOf(grid, 40, 12, 65);
  const double dx = (12.5 - 15.0) / 10.0;
  const double dy = (65.5 - 70.0) / 20.0;
  constexpr std::size_t kBin = (3 * 4 + 1) * 8 + 2;
  for (std::size_t i = 0; i < histogram.size(); ++i) {
    EXPECT_NEAR(histogram[i], i == kBin ? std::exp(-0.5 * (dx * dx + dy * dy) / 0.25) : 0.0, 1e-6) << i;
  }
}

TEST(SubimageGrid, APixelBelongsToOneSubimageAlsoWhenFourDoNotDivideTheSize) {
  constexpr int kWidth_px = 18;  // subimages of 4.5 pixels: the centres of the columns 4 and 13 lie on a border
  const SubimageGrid grid({kWidth_px, 16}, 0.5);
  const int first[] = {0, 4, 9, 13, kWidth_px};
  for (int subimage = 0; subimage < 4; ++subimage) {
    for (int x = first[subimage]; x < first[subimage + 1]; ++x) {
      const Histogram histogram = pixelOf(grid, kWidth_px, x, 0);
      EXPECT_GT(histogram[static_cast<std::size_t>(subimage) * 8 + 2], 0.0F) << x;
      EXPECT_EQ(std::count(histogram.begin(), histogram.end(), 0.0F), 127) << x;
    }
  }
}

TEST(SubimageGrid, NoPixelsAddNothing) {
  const SubimageGrid grid({40, 40}, 0.5);
  const std::vector<float> values(40, 1.0F);
  const std::vector<std::uint8_t> bins(40, 2);
  Histogram histogram{};
  grid.addRow(3, 5, 5, values.data(), bins.data(), histogram);
  grid.addRow(3, 5, 2, values.data(), bins.data(), histogram);
  EXPECT_EQ(histogram, Histogram{});
}

}  // namespace
}  // namespace visual_localization

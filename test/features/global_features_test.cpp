#include "visual_localization/features/global_features.h"

#include <numeric>
#include <stdexcept>

#include <gtest/gtest.h>

#include "test/support/synthetic.h"

namespace visual_localization {
namespace {

double similarity(const GlobalFeatures& query, const GlobalFeatures& training) {
  return histogramIntersection(query.wgoh, training.wgoh) * histogramIntersection(query.wgii, training.wgii);
}

bool same(const GlobalFeatures& a, const GlobalFeatures& b) { return a.wgoh == b.wgoh && a.wgii == b.wgii; }

float sumOf(const GlobalFeatures::Histogram& histogram) {
  return std::accumulate(histogram.begin(), histogram.end(), 0.0F);
}

TEST(GlobalExtractor, ScalesBothToSumOne) {
  for (const int width_px : {320, 64}) {
    const GlobalFeatures features = GlobalExtractor().extract(test::wall(width_px, 240, 1));
    EXPECT_NEAR(sumOf(features.wgoh), 1.0F, 1e-5F);
    EXPECT_NEAR(sumOf(features.wgii), 1.0F, 1e-5F);
  }
}

TEST(GlobalExtractor, TheSameImageIsWhollySimilar) {
  const GlobalFeatures features = GlobalExtractor().extract(test::viewOf(test::wall(320, 240, 2), 0));
  EXPECT_DOUBLE_EQ(similarity(features, features), 1.0);
}

TEST(GlobalExtractor, ASmallShiftIsMoreSimilarThanALargeOneOrAnotherPlace) {
  const cv::Mat wall = test::wall(600, 240, 3);
  GlobalExtractor extractor;
  const GlobalFeatures here = extractor.extract(test::viewOf(wall, 0));
  const double near = similarity(here, extractor.extract(test::viewOf(wall, 8)));
  const double farther = similarity(here, extractor.extract(test::viewOf(wall, 24)));
  const double elsewhere = similarity(here, extractor.extract(test::viewOf(wall, 200)));
  const double another = similarity(here, extractor.extract(test::viewOf(test::wall(320, 240, 4), 0)));
  EXPECT_GT(near, farther);
  EXPECT_GT(farther, elsewhere);
  EXPECT_GT(farther, another);
}

TEST(GlobalExtractor, BrighterIsTheSame) {
  const cv::Mat image = test::viewOf(test::wall(320, 240, 5), 0) / 2;
  GlobalExtractor extractor;
  const GlobalFeatures features = extractor.extract(image);
  EXPECT_TRUE(same(extractor.extract(image + 100), features));
}

TEST(GlobalExtractor, WithMoreContrastTheOrientationsStay) {
  const cv::Mat image = test::viewOf(test::wall(320, 240, 6), 0) / 3;
  GlobalExtractor extractor;
  const GlobalFeatures features = extractor.extract(image);
  const GlobalFeatures contrasty = extractor.extract(image * 3);
  EXPECT_NEAR(histogramIntersection(contrasty.wgoh, features.wgoh), 1.0, 1e-5);
  EXPECT_LT(histogramIntersection(contrasty.wgii, features.wgii), 0.99);  // epsilon is absolute
}

TEST(GlobalExtractor, APlainImageHasInvariantsOnly) {
  const GlobalFeatures features = GlobalExtractor().extract(cv::Mat(240, 320, CV_8UC1, cv::Scalar(90)));
  EXPECT_EQ(features.wgoh, GlobalFeatures::Histogram{});
  EXPECT_NEAR(sumOf(features.wgii), 1.0F, 1e-5F);
  EXPECT_EQ(similarity(features, features), 0.0);
}

TEST(GlobalExtractor, RemembersNothingOfTheImagesBefore) {
  const cv::Mat image = test::viewOf(test::wall(320, 240, 7), 0);
  const cv::Mat small = test::wall(40, 30, 8);
  GlobalExtractor used;
  used.extract(small);
  used.extract(test::wall(640, 300, 9));
  EXPECT_TRUE(same(used.extract(image), GlobalExtractor().extract(image)));
  EXPECT_TRUE(same(used.extract(image), GlobalExtractor().extract(image)));
  EXPECT_TRUE(same(used.extract(small), GlobalExtractor().extract(small)));
}

TEST(GlobalExtractor, RefusesOtherImages) {
  GlobalExtractor extractor;
  EXPECT_THROW(extractor.extract(cv::Mat()), std::invalid_argument);
  EXPECT_THROW(extractor.extract(cv::Mat(240, 320, CV_8UC3, cv::Scalar::all(0))), std::invalid_argument);
  EXPECT_THROW(extractor.extract(cv::Mat(240, 320, CV_16UC1, cv::Scalar(0))), std::invalid_argument);
  EXPECT_THROW(extractor.extract(cv::Mat(15, 320, CV_8UC1, cv::Scalar(0))), std::invalid_argument);
  EXPECT_THROW(extractor.extract(cv::Mat(240, 15, CV_8UC1, cv::Scalar(0))), std::invalid_argument);
}

}  // namespace
}  // namespace visual_localization

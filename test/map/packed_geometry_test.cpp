
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "map/map_schema.h"
#include "test/map/stored_geometry.h"
#include "test/support/refusal.h"

namespace visual_localization {
namespace {

using map_schema::PackedGeometry;
using map_schema::packGeometry;
using test::bytesOf;
using test::kFeatures;
using test::kNan;
using test::packedAsIs;
using testing::HasSubstr;

ImageGeometry unpacked(const PackedGeometry& packed, std::size_t features) {
  return map_schema::unpackGeometry(bytesOf(packed.pose), bytesOf(packed.points), features);
}

TEST(PackedGeometry, ComesBackToTheLastBit) {
  const ImageGeometry geometry = test::exampleGeometry(kFeatures);
  const PackedGeometry packed = packGeometry(geometry, kFeatures);
  EXPECT_EQ(packed.pose.size(), 140U);
  EXPECT_EQ(packed.points.size(), 20U * kFeatures / 2);
  EXPECT_TRUE(test::same(unpacked(packed, kFeatures), geometry));
}

TEST(PackedGeometry, ManyFeaturesNeedLongerIndices) {
  ImageGeometry geometry = test::exampleGeometry(4);
  geometry.landmarks.back().feature = 65535;
  EXPECT_EQ(packGeometry(geometry, 65536).points.size(), 2U * 20U);
  EXPECT_TRUE(test::same(unpacked(packGeometry(geometry, 65536), 65536), geometry));
  geometry.landmarks.back().feature = 65536;
  EXPECT_EQ(packGeometry(geometry, 65537).points.size(), 2U * 22U);
  EXPECT_TRUE(test::same(unpacked(packGeometry(geometry, 65537), 65537), geometry));
}

TEST(PackedGeometry, NeedsNoLandmarks) {
  const ImageGeometry geometry = test::exampleGeometry(0);
  EXPECT_TRUE(test::same(unpacked(packGeometry(geometry, 0), 0), geometry));
}

TEST(PackedGeometry, ASingularCovarianceOfAnyScaleSurvivesRounding) {
  Eigen::Matrix<double, 6, 1> axis;
  axis << 1e3, 1.0 / 3.0, -1e-2, 1e-7, 0.0, 1e-9;
  ImageGeometry geometry = test::exampleGeometry(4);
  geometry.covariance = axis * axis.transpose();
  const ImageGeometry read = unpacked(packGeometry(geometry, 4), 4);
  EXPECT_TRUE(read.covariance.isApprox(geometry.covariance, 1e-7));
  EXPECT_EQ(read.covariance, read.covariance.transpose());
  EXPECT_NO_THROW(packGeometry(read, 4));
}

TEST(SigmaClass, KnownAnswers) {
  EXPECT_EQ(map_schema::sigmaClass(0.0F), 0);
  EXPECT_EQ(map_schema::sigmaClass(0.001F), 0);
  EXPECT_EQ(map_schema::sigmaClass(0.00101F), 1);
  EXPECT_EQ(map_schema::sigmaClass(1.0F), 142);  // ln 1000 / ln 1.05 = 141.6
  EXPECT_EQ(map_schema::sigmaClass(1e9F), 255);
  EXPECT_FLOAT_EQ(map_schema::sigmaOf(0), 0.001F);
  EXPECT_FLOAT_EQ(map_schema::sigmaOf(14), 0.0019799316F);
  EXPECT_NEAR(map_schema::sigmaOf(255), 253.0F, 1.0F);
}

TEST(SigmaClass, RoundsUpAndComesBack) {
  for (int i = 0; i < 256; ++i) {
    const auto of_class = static_cast<std::uint8_t>(i);
    EXPECT_EQ(map_schema::sigmaClass(map_schema::sigmaOf(of_class)), of_class);
  }
  for (float sigma_m = 0.001F; sigma_m < 250.0F; sigma_m *= 1.013F) {
    const float stored_m = map_schema::sigmaOf(map_schema::sigmaClass(sigma_m));
    EXPECT_GE(stored_m, sigma_m);
    EXPECT_LE(stored_m, 1.051F * sigma_m);
  }
}

TEST(PackedGeometry, WhatCannotBeReadIsNotWritten) {
  std::vector<test::Unusable> cases = test::unusable();
  // These cannot be said in a file.
  cases.push_back({[](ImageGeometry& g) { g.covariance(0, 5) = 0.0; }, "covariance"});
  cases.push_back({[](ImageGeometry& g) { g.covariance(2, 2) = 1e39; }, "covariance"});
  cases.push_back({[](ImageGeometry& g) { g.landmarks[4].sigma_along_m = kNan; }, "standard deviation"});
  cases.push_back({[](ImageGeometry& g) { g.landmarks[4].sigma_across_m = HUGE_VALF; }, "standard deviation"});
  cases.push_back({[](ImageGeometry& g) { g.landmarks[4].sigma_along_m = -1e-6F; }, "standard deviation"});
  for (std::size_t i = 0; i < cases.size(); ++i) {
    ImageGeometry geometry = test::exampleGeometry(kFeatures);
    cases[i].change(geometry);
    EXPECT_THAT(test::refusalOf<std::runtime_error>([&] { packGeometry(geometry, kFeatures); }),
                HasSubstr(cases[i].reason))
        << i;
  }
}

TEST(PackedGeometry, HasTheDocumentedForm) {
  const ImageGeometry geometry = test::exampleGeometry(kFeatures);
  EXPECT_EQ(packGeometry(geometry, kFeatures).pose, packedAsIs(geometry).pose);
  EXPECT_EQ(packGeometry(geometry, kFeatures).points, packedAsIs(geometry).points);
}

}  // namespace
}  // namespace visual_localization

#include "camera/lens_names.h"

#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/support/refusal.h"

namespace visual_localization {
namespace {

using testing::HasSubstr;
using Coefficients = std::vector<double>;

CameraModel cameraWith(const std::string& name, const Coefficients& coefficients) {
  const Lens lens = lensOf(name, coefficients);
  return CameraModel({{640, 480}, 500.0, 500.0, 320.0, 240.0, lens.distortion, lens.coefficients});
}

Eigen::Vector2d seen(const std::string& name, const Coefficients& coefficients) {
  return cameraWith(name, coefficients).project({0.4, -0.3, 1.0});
}

std::string refusal(const std::string& name, const Coefficients& coefficients) {
  return test::refusalOf<CameraError>([&] { cameraWith(name, coefficients); });
}

const Coefficients kFour{-0.1, 0.01, 1e-3, -1e-3};
const Coefficients kFive{-0.1, 0.01, 1e-3, -1e-3, 0.002};
const Coefficients kEight{-0.1, 0.01, 1e-3, -1e-3, 0.002, 0.3, -0.02, 0.001};

Coefficients with(Coefficients coefficients, std::size_t count) {
  coefficients.resize(count, 0.0);
  return coefficients;
}

TEST(LensNames, ALensWithoutDistortionNeedsNoName) {
  for (const char* name : {"", "none", "None", "plumb_bob", "rational_polynomial", "radtan"}) {
    for (const std::size_t count : {0U, 4U, 5U, 8U, 12U, 14U}) {
      EXPECT_TRUE(cameraWith(name, Coefficients(count, 0.0)).isPinhole()) << name << " " << count;
    }
  }
}

TEST(LensNames, ZerosBehindTheLastOneThatCountsChangeNothing) {
  for (const std::size_t count : {5U, 8U, 12U, 14U}) {
    for (const char* name : {"plumb_bob", "rational_polynomial", "radial-tangential"}) {
      EXPECT_EQ(seen(name, with(kFive, count)), seen("plumb_bob", kFive)) << name << " " << count;
    }
    EXPECT_EQ(seen("", with(kFour, count)), seen("plumb_bob", kFour)) << count;
    EXPECT_EQ(seen("equidistant", with(kFour, count)), seen("equidistant", kFour)) << count;
  }
  EXPECT_EQ(seen("rational_polynomial", kFour), seen("plumb_bob", kFour));
}

TEST(LensNames, EightAreThoseOfTheRationalModelUnderAnyName) {
  const Eigen::Vector2d expected = seen("rational_polynomial", kEight);
  EXPECT_NE(expected, seen("plumb_bob", kFive));
  for (const char* name : {"", "plumb_bob", "rational_polynomial"}) {
    for (const std::size_t count : {8U, 12U, 14U}) EXPECT_EQ(seen(name, with(kEight, count)), expected) << name;
  }
}

TEST(LensNames, TheFisheyeHasManyNames) {
  const Eigen::Vector2d expected = seen("equidistant", kFour);
  EXPECT_NE(expected, seen("plumb_bob", kFour));
  for (const char* name : {"fisheye", "Kannala-Brandt", "kannala_brandt4", "KANNALA_BRANDT", "equi"}) {
    EXPECT_EQ(seen(name, kFour), expected) << name;
  }
  EXPECT_FALSE(cameraWith("equidistant", {}).isPinhole()) << "without coefficients it is one still";
  EXPECT_EQ(seen("equidistant", {}), seen("fisheye", {0.0, 0.0, 0.0, 0.0}));
}

TEST(LensNames, UsualCountsStayAsTheyAre) {
  EXPECT_EQ(lensOf("plumb_bob", kFour).coefficients, kFour);
  EXPECT_EQ(lensOf("plumb_bob", {}).coefficients, Coefficients());
  EXPECT_EQ(lensOf("rational_polynomial", Coefficients(8, 0.0)).distortion, Distortion::kRationalPolynomial);
}

TEST(LensNames, WhatTheyDoNotSayIsRefused) {
  EXPECT_THAT(refusal("", kFour), HasSubstr("says nothing about its 4 coefficients: name plumb_bob or equidistant"));
  EXPECT_THAT(refusal("none", kFive), HasSubstr("'none' has coefficients that are not zero"));
  EXPECT_THAT(refusal("omni\x1b[31m", {}), HasSubstr("unknown distortion model 'omni [31m'"));
  Coefficients prism = with(kEight, 12);
  prism[11] = 1e-3;
  EXPECT_THAT(refusal("rational_polynomial", prism), HasSubstr("coefficient 11 is not zero"));
  EXPECT_THAT(refusal("plumb_bob", {0.1, 0.2, 0.3}), HasSubstr("takes 0, 4 or 5 coefficients, not 3"));
  EXPECT_THAT(refusal("equidistant", kFive), HasSubstr("takes 4 coefficients, not 5"));
  EXPECT_THAT(refusal("fisheye", Coefficients(1000000, 0.0)), HasSubstr("takes at most 14 coefficients, not 1000000"));
  EXPECT_THAT(refusal("", with({std::numeric_limits<double>::quiet_NaN()}, 5)), HasSubstr("coefficient 0 = nan"));
}

}  // namespace
}  // namespace visual_localization

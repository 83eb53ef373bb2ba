#include "features/sift/native_sift_extractor.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "test/support/synthetic.h"
#include "visual_localization/features/feature_matcher.h"
#include "visual_localization/features/sift.h"

namespace visual_localization {
namespace {

constexpr float kQuarterPx = 0.25F;  ///< OpenCV 4.6's keypoints lie so far to the right of and below the thing

/// A bright or dark spot on a slope, which if steep gives it one orientation.
cv::Mat spot(int width, int height, double x, double y, double sigma_px, double contrast, double slope_y = 0.0) {
  cv::Mat image(height, width, CV_8UC1);
  image.forEach<std::uint8_t>([&](std::uint8_t& pixel, const int* at) {
    const double squared = (at[1] - x) * (at[1] - x) + (at[0] - y) * (at[0] - y);
    const double spot = contrast * std::exp(-0.5 * squared / (sigma_px * sigma_px));
    pixel = cv::saturate_cast<std::uint8_t>(120.0 + slope_y * (at[0] - y) + spot);
  });
  return image;
}

cv::Mat noiseImage(int width, int height, std::uint32_t seed) {
  cv::RNG random(seed);
  cv::Mat image(height, width, CV_8UC1);
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  return image;
}

LocalFeatures extract(const cv::Mat& image, const SiftConfig& config = SiftConfig()) {
  return NativeSiftExtractor(config).extract(image);
}

/// Share of `from` that `to` has a feature for at the place, size and angle which `moved` says.
double shareFound(const LocalFeatures& from, const LocalFeatures& to, const std::function<Keypoint(Keypoint)>& moved) {
  std::size_t found = 0;
  for (const Keypoint& keypoint : from.keypoints()) {
    const Keypoint expected = moved(keypoint);
    found += static_cast<std::size_t>(
        std::any_of(to.keypoints().begin(), to.keypoints().end(), [&expected](const Keypoint& other) {
          const float turn_deg = std::remainder(other.angle_deg - expected.angle_deg, 360.0F);
          return std::hypot(other.x_px - expected.x_px, other.y_px - expected.y_px) < 0.5F &&
                 std::abs(other.size_px / expected.size_px - 1.0F) < 0.1F && std::abs(turn_deg) < 5.0F;
        }));
  }
  return static_cast<double>(found) / static_cast<double>(from.size());
}

TEST(NativeSift, ASpotIsFoundOnceAtItsPlaceAndSize) {
  for (const double sigma_px : {2.0, 3.0, 5.0, 8.0}) {
    for (const double contrast : {100.0, -100.0}) {
      SCOPED_TRACE(std::to_string(sigma_px) + ' ' + std::to_string(contrast));
      const LocalFeatures features = extract(spot(160, 120, 70.2, 60.6, sigma_px, contrast));
      ASSERT_FALSE(features.empty());
      const Keypoint& keypoint = features.keypoints()[0];
      for (const Keypoint& other : features.keypoints()) {  // it is round: any orientation will do
        EXPECT_NEAR(other.x_px, keypoint.x_px, 0.05F);
        EXPECT_NEAR(other.size_px, keypoint.size_px, 0.05F);
      }
      EXPECT_NEAR(keypoint.x_px, 70.2F + kQuarterPx, 0.1F);
      EXPECT_NEAR(keypoint.y_px, 60.6F + kQuarterPx, 0.1F);
      // A difference of Gaussians of ratio k is extreme at 1 / sqrt(k) of the spot; the camera is given half a pixel.
      const double expected_px = 2.0 * std::sqrt(sigma_px * sigma_px - 0.25) / std::exp2(1.0 / 6.0);
      EXPECT_NEAR(keypoint.size_px, expected_px, 0.06 * expected_px);
    }
  }
}

TEST(NativeSift, AngleIsThatOfTheSlope) {
  const LocalFeatures down = extract(spot(160, 120, 70.0, 60.0, 4.0, 50.0, 1.5));  // brighter towards the bottom
  const LocalFeatures up = extract(spot(160, 120, 70.0, 60.0, 4.0, 50.0, -1.5));
  ASSERT_EQ(down.size(), 1U);
  ASSERT_EQ(up.size(), 1U);
  EXPECT_NEAR(down.keypoints()[0].angle_deg, 90.0F, 5.0F) << "clockwise from the right";
  EXPECT_NEAR(up.keypoints()[0].angle_deg, 270.0F, 5.0F);
}

TEST(NativeSift, ATurnedImageShowsTheSameFeaturesTurned) {
  const cv::Mat image = test::viewOf(test::wall(320, 240, 11), 0);
  cv::Mat turned;
  cv::rotate(image, turned, cv::ROTATE_90_CLOCKWISE);
  const LocalFeatures all = extract(image);
  std::vector<std::size_t> first_octave;  // the further ones begin at another corner of the image
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all.keypoints()[i].size_px < 3.2F) first_octave.push_back(i);
  }
  const LocalFeatures before = all.subset(first_octave);
  const LocalFeatures after = extract(turned);
  const double share = shareFound(before, after, [](Keypoint keypoint) {
    return Keypoint{240.0F - 1.0F + 2.0F * kQuarterPx - keypoint.y_px, keypoint.x_px, keypoint.size_px,
                    std::fmod(keypoint.angle_deg + 90.0F, 360.0F)};
  });
  ASSERT_GT(before.size(), 40U);
  EXPECT_GT(share, 0.97);
  EXPECT_GT(static_cast<double>(matchSymmetric(before, after, 0.6).size()), 0.8 * static_cast<double>(before.size()));
}

TEST(NativeSift, AShiftedImageShowsTheSameFeaturesShifted) {
  const cv::Mat wall = test::wall(400, 240, 5);
  const LocalFeatures here = extract(test::viewOf(wall, 0));
  const LocalFeatures there = extract(test::viewOf(wall, 16));
  const auto matches = matchSymmetric(here, there, 0.6);
  ASSERT_GT(matches.size(), 100U);
  std::size_t shifted = 0;
  for (const FeatureMatch& match : matches) {
    const Keypoint& a = here.keypoints()[match.a];
    const Keypoint& b = there.keypoints()[match.b];
    if (std::abs(a.x_px - b.x_px - 16.0F) < 1.0F && std::abs(a.y_px - b.y_px) < 1.0F) ++shifted;
  }
  EXPECT_GT(static_cast<double>(shifted), 0.95 * static_cast<double>(matches.size()));
}

TEST(NativeSift, BrightnessChangesNothing) {
  cv::Mat image = test::viewOf(test::wall(320, 240, 6), 0);
  image.convertTo(image, CV_8UC1, 0.5);
  const LocalFeatures dark = extract(image);
  const LocalFeatures bright = extract(image + cv::Scalar(100));
  EXPECT_GT(dark.size(), 50U);
  EXPECT_GT(shareFound(dark, bright, [](Keypoint keypoint) { return keypoint; }), 0.99);
}

TEST(NativeSift, GivesTheSameEveryTimeWhateverCameBefore) {
  const cv::Mat image = test::viewOf(test::wall(320, 240, 7), 0);
  NativeSiftExtractor extractor{SiftConfig()};
  const LocalFeatures first = extractor.extract(image);
  extractor.extract(noiseImage(401, 333, 1));
  extractor.extract(noiseImage(37, 16, 2));
  const LocalFeatures again = extractor.extract(image);
  EXPECT_EQ(first.bytes(), again.bytes());
  ASSERT_EQ(first.size(), again.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first.keypoints()[i].x_px, again.keypoints()[i].x_px);
    EXPECT_EQ(first.keypoints()[i].angle_deg, again.keypoints()[i].angle_deg);
  }
}

TEST(NativeSift, ImagesWithoutTextureHaveNoFeatures) {
  for (const int grey : {0, 90, 255}) {
    EXPECT_TRUE(extract(cv::Mat(240, 320, CV_8UC1, cv::Scalar(grey))).empty());
    EXPECT_TRUE(extract(cv::Mat(16, 16, CV_8UC1, cv::Scalar(grey))).empty());
  }
}

TEST(NativeSift, KeypointsLieInTheImageAndDescriptorsHaveTheirLength) {
  cv::Mat saturated = noiseImage(90, 70, 4);
  cv::threshold(saturated, saturated, 127.0, 255.0, cv::THRESH_BINARY);
  for (const cv::Mat& image : {noiseImage(320, 240, 3), saturated, noiseImage(16, 2000, 6), noiseImage(500, 17, 7)}) {
    const LocalFeatures features = extract(image);
    EXPECT_FALSE(features.empty()) << image.size();
    for (std::size_t i = 0; i < features.size(); ++i) {
      const Keypoint& keypoint = features.keypoints()[i];
      ASSERT_GT(keypoint.x_px, 0.0F);
      ASSERT_LT(keypoint.x_px, static_cast<float>(image.cols));
      ASSERT_GT(keypoint.y_px, 0.0F);
      ASSERT_LT(keypoint.y_px, static_cast<float>(image.rows));
      ASSERT_GE(keypoint.angle_deg, 0.0F);
      ASSERT_LT(keypoint.angle_deg, 360.0F);
      ASSERT_NEAR(1.0F / features.inverseNorm(i), 512.0F, 26.0F);
    }
  }
}

TEST(NativeSift, KeepsTheStrongest) {
  const cv::Mat image = test::viewOf(test::wall(320, 240, 8), 0);
  const LocalFeatures all = extract(image);
  SiftConfig config;
  for (const int most : {1, 50, 100000}) {
    config.max_features = most;
    const LocalFeatures kept = extract(image, config);
    const std::size_t expected = std::min(all.size(), static_cast<std::size_t>(most));
    EXPECT_GE(kept.size(), expected);
    EXPECT_LE(kept.size(), expected + 5) << "those with several orientations are equally strong";
    EXPECT_EQ(shareFound(kept, all, [](Keypoint keypoint) { return keypoint; }), 1.0);
  }
}

TEST(NativeSift, DenseNoiseHasNoMoreFeaturesThanCanBeMatched) {
  cv::Mat noise(2048, 2816, CV_8UC1);
  cv::RNG(7).fill(noise, cv::RNG::UNIFORM, 0, 256);
  const std::size_t kept = extract(noise).size();
  EXPECT_GE(kept, static_cast<std::size_t>(kMostLocalFeatures)) << "there are more";
  EXPECT_LE(kept, kMostLocalFeatures + 5U);
}

TEST(NativeSift, RefusesWhatIsNoGreyImage) {
  NativeSiftExtractor extractor{SiftConfig()};
  EXPECT_THROW(extractor.extract(cv::Mat()), std::invalid_argument);
  EXPECT_THROW(extractor.extract(cv::Mat(240, 320, CV_8UC3)), std::invalid_argument);
  EXPECT_THROW(extractor.extract(cv::Mat(240, 320, CV_16UC1)), std::invalid_argument);
  EXPECT_THROW(extractor.extract(cv::Mat(8, 320, CV_8UC1)), std::invalid_argument);
}

}  // namespace
}  // namespace visual_localization

// Our SIFT features are OpenCV's, and the same on every CPU.
#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "features/sift/native_sift_extractor.h"
#include "test/support/cpu_targets.h"
#include "test/support/synthetic.h"
#include "visual_localization/features/local_features.h"
#include "visual_localization/features/sift.h"

namespace visual_localization {
namespace {

/// Blocks of all sizes, softened as by a lens.
cv::Mat textured(int width, int height, std::uint32_t seed) {
  cv::RNG random(seed);
  cv::Mat image(height, width, CV_8UC1, cv::Scalar(128));
  for (int i = 0; i < width * height / 300; ++i) {
    const int size = 2 + static_cast<int>(std::exp(random.uniform(0.0, 3.5)));
    const cv::Rect block(random.uniform(-10, width), random.uniform(-10, height), size, random.uniform(2, 2 * size));
    cv::rectangle(image, block, cv::Scalar(random.uniform(0, 256)), cv::FILLED);
  }
  cv::GaussianBlur(image, image, {}, 0.8);
  return image;
}

/// How well the features of one extractor are found among those of another.
struct Agreement {
  double same_keypoint = 0.0;    ///< share within 0.5 px, 1.1 x size and 5 degrees
  double same_descriptor = 0.0;  ///< share of those whose descriptors, of length 512, are less apart than allowed
};

Agreement agreement(const LocalFeatures& of, const LocalFeatures& with, double apart) {
  std::size_t keypoints = 0;
  std::size_t descriptors = 0;
  for (std::size_t i = 0; i < of.size(); ++i) {
    const Keypoint& a = of.keypoints()[i];
    double nearest = HUGE_VAL;
    for (std::size_t j = 0; j < with.size(); ++j) {
      const Keypoint& b = with.keypoints()[j];
      if (std::hypot(a.x_px - b.x_px, a.y_px - b.y_px) > 0.5F) continue;
      if (std::abs(std::log(a.size_px / b.size_px)) > std::log(1.1F)) continue;
      if (std::abs(std::remainder(a.angle_deg - b.angle_deg, 360.0F)) > 5.0F) continue;
      double squared = 0.0;
      for (std::size_t k = 0; k < kSiftDimension; ++k) {
        const double difference = of.bytes(i)[k] - with.bytes(j)[k];
        squared += difference * difference;
      }
      nearest = std::min(nearest, std::sqrt(squared));
    }
    keypoints += static_cast<std::size_t>(nearest < HUGE_VAL);
    descriptors += static_cast<std::size_t>(nearest < apart);
  }
  const auto share = [](std::size_t part, std::size_t whole) {
    return whole == 0 ? 1.0 : static_cast<double>(part) / static_cast<double>(whole);
  };
  return {share(keypoints, of.size()), share(descriptors, keypoints)};
}

void expectAgreement(const LocalFeatures& a, const LocalFeatures& b, double least, double apart) {
  const double count = static_cast<double>(a.size());
  EXPECT_NEAR(static_cast<double>(b.size()), count, 2.0 + (1.0 - least) * count);
  const double slack = count < 50.0 ? 2.0 / std::max(count, 2.0) : 0.0;
  EXPECT_GE(agreement(a, b, apart).same_keypoint, least - slack);
  EXPECT_GE(agreement(b, a, apart).same_keypoint, least - slack);
  EXPECT_GE(agreement(a, b, apart).same_descriptor, least - slack);
}

void expectLikeOpenCv(const cv::Mat& image, const SiftConfig& config, double least = 0.97) {
  // OpenCV rounds to bytes before the roots are taken, and the root of a half is 6 of 512.
  const double apart = config.hellinger ? 40.0 : 10.0;
  expectAgreement(makeSiftExtractor(config)->extract(image), makeOpenCvSiftExtractor(config)->extract(image), least,
                  apart);
}

TEST(NativeSiftEquivalence, TheFeaturesAreOpenCvsForEverySize) {
  for (const cv::Size size :
       {cv::Size(320, 240), cv::Size(16, 16), cv::Size(17, 19), cv::Size(33, 47), cv::Size(100, 75), cv::Size(127, 129),
        cv::Size(333, 201), cv::Size(1241, 376), cv::Size(16, 2000), cv::Size(2000, 16), cv::Size(512, 512)}) {
    SCOPED_TRACE(std::to_string(size.width) + "x" + std::to_string(size.height));
    expectLikeOpenCv(textured(size.width, size.height, 5), SiftConfig());
  }
}

TEST(NativeSiftEquivalence, TheFeaturesAreOpenCvsForEveryConfiguration) {
  const cv::Mat image = textured(320, 240, 6);
  for (const int layers : {1, 2, 3, 4, 5}) {
    SCOPED_TRACE("layers " + std::to_string(layers));
    SiftConfig config;
    config.octave_layers = layers;
    expectLikeOpenCv(image, config);
  }
  SiftConfig contrast;
  contrast.contrast_threshold = 0.1;
  expectLikeOpenCv(image, contrast);
  contrast.contrast_threshold = 0.0;
  expectLikeOpenCv(image, contrast, 0.93);
  SiftConfig edge;
  edge.edge_threshold = 3.0;
  expectLikeOpenCv(image, edge);
  for (const double sigma_px : {0.8, 1.2, 3.0}) {
    SCOPED_TRACE("sigma " + std::to_string(sigma_px));
    SiftConfig sigma;
    sigma.sigma_px = sigma_px;
    expectLikeOpenCv(image, sigma);
  }
  SiftConfig strongest;
  strongest.max_features = 60;
  expectLikeOpenCv(image, strongest);
  expectLikeOpenCv(image, SiftConfig::uprightHellinger());
}

TEST(NativeSiftEquivalence, UprightFeaturesAreOneForEachPlaceAndScale) {
  const cv::Mat image = textured(320, 240, 6);
  SiftConfig config;
  const LocalFeatures turned = makeSiftExtractor(config)->extract(image);
  config.upright = true;
  const LocalFeatures upright = makeSiftExtractor(config)->extract(image);
  EXPECT_LT(upright.size(), turned.size());
  for (std::size_t i = 0; i < upright.size(); ++i) {
    const Keypoint& point = upright.keypoints()[i];
    EXPECT_EQ(point.angle_deg, 0.0F);
    EXPECT_TRUE(std::any_of(turned.keypoints().begin(), turned.keypoints().end(), [&](const Keypoint& other) {
      return other.x_px == point.x_px && other.y_px == point.y_px && other.size_px == point.size_px;
    }));
  }
}

TEST(NativeSiftEquivalence, HellingerDescriptorsAreTheRootsOfTheOthers) {
  const cv::Mat image = textured(320, 240, 6);
  SiftConfig config;
  const LocalFeatures plain = makeSiftExtractor(config)->extract(image);
  config.hellinger = true;
  const LocalFeatures rooted = makeSiftExtractor(config)->extract(image);
  ASSERT_EQ(rooted.size(), plain.size());
  for (std::size_t i = 0; i < plain.size(); ++i) {
    double sum = 0.0;
    for (std::size_t k = 0; k < kSiftDimension; ++k) sum += plain.bytes(i)[k];
    for (std::size_t k = 0; k < kSiftDimension; ++k) {
      const double before = plain.bytes(i)[k];
      const auto rootOf = [sum](double bin) { return 512.0 * std::sqrt(std::max(0.0, bin) / sum); };
      // The bytes of the others are rounded, by up to a half; so is their sum.
      EXPECT_GE(rooted.bytes(i)[k], 0.98 * rootOf(before - 0.51) - 1.0);
      EXPECT_LE(rooted.bytes(i)[k], 1.02 * rootOf(before + 0.51) + 1.0);
    }
    EXPECT_NEAR(rooted.inverseNorm(i), 1.0 / 512.0, 0.02 / 512.0);
  }
}

TEST(NativeSiftEquivalence, TheFeaturesAreOpenCvsOnWallsAndNoise) {
  expectLikeOpenCv(test::viewOf(test::wall(320, 240, 3), 0), SiftConfig());
  // Noise has as many features at the border as elsewhere, and the doubled image is continued in another way there.
  constexpr double kLeast = 0.93;
  cv::Mat noise(240, 320, CV_8UC1);
  cv::RNG(3).fill(noise, cv::RNG::UNIFORM, 0, 256);
  expectLikeOpenCv(noise, SiftConfig(), kLeast);
  cv::threshold(noise, noise, 127.0, 255.0, cv::THRESH_BINARY);
  expectLikeOpenCv(noise, SiftConfig(), kLeast);
}

TEST(NativeSiftEquivalence, EveryKindOfVectorFindsTheSame) {
  const cv::Mat image = textured(203, 151, 7);
  const auto extractor = makeSiftExtractor(SiftConfig());
  const LocalFeatures widest = extractor->extract(image);
  ASSERT_GT(widest.size(), 100U);
  std::size_t tried = 0;
  test::forEachTarget([&] {
    expectAgreement(extractor->extract(image), widest, 0.99, 10.0);
    ++tried;
  });
  EXPECT_GE(tried, 1U);
}

}  // namespace
}  // namespace visual_localization

#include "node/shared_localizer.h"

#include <atomic>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/node/small_map.h"
#include "test/support/refusal.h"
#include "test/support/stamps.h"
#include "test/support/swarm_config.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

using test::kSecond_ns;

cv::Mat noise() {
  cv::Mat image(240, 320, CV_8UC1);
  cv::randu(image, 0, 255);
  return image;
}

TEST(SharedLocalizer, WithoutMapThereIsNoResult) {
  SharedLocalizer localizer{test::swarmConfig()};
  EXPECT_FALSE(localizer.process(kSecond_ns, noise()).has_value());
  EXPECT_FALSE(localizer.relocalizeAnywhere());
  EXPECT_FALSE(localizer.relocalizeAround({0.0, 0.0}, 5.0));
  EXPECT_EQ(localizer.map(), nullptr);
}

TEST(SharedLocalizer, WithMapEveryImageHasAResult) {
  SharedLocalizer localizer{test::swarmConfig()};
  localizer.setMap(test::smallMap());
  const auto result = localizer.process(kSecond_ns, noise());
  ASSERT_TRUE(result.has_value());
  EXPECT_EQ(result->estimate.stamp_ns, kSecond_ns);
  EXPECT_EQ(result->particles.size(), static_cast<std::size_t>(LocalizerConfig{}.dpso.particles));
  EXPECT_EQ(result->map, localizer.map());
}

TEST(SharedLocalizer, AMaskHoldsForTheMapThatComesLaterAndForTheNext) {
  LocalizerConfig config;
  config.features = "sift";
  SharedLocalizer localizer{config};
  cv::Mat left(240, 320, CV_8U, cv::Scalar(255));
  left.colRange(160, 320).setTo(0);
  localizer.setMask(Mask(left));
  for (int i = 0; i < 2; ++i) {
    localizer.setMap(test::smallMap());
    const auto result = localizer.process((i + 1) * kSecond_ns, noise());
    ASSERT_TRUE(result.has_value());
    ASSERT_GT(result->local.size(), 0U);
    const int width_px = result->map->header().image_size.width;
    for (const Keypoint& keypoint : result->local.keypoints())
      EXPECT_LE(keypoint.x_px, 0.5F * static_cast<float>(width_px));
  }
}

TEST(SharedLocalizer, AGuessWaitsForTheMap) {
  SharedLocalizer localizer{test::swarmConfig()};
  const SharedLocalizer::Guess guess{{2.0, 20.0}, Eigen::Matrix2d::Zero()};
  EXPECT_FALSE(localizer.relocalizeAt(guess));
  localizer.setMap(test::smallMap());
  const auto result = localizer.process(kSecond_ns, noise());
  ASSERT_TRUE(result.has_value());
  for (const Particle& particle : result->particles) {
    if (particle.kind == ParticleKind::kQuantum) continue;
    EXPECT_NEAR(particle.position_m.y(), 20.0, 5.0);
  }
}

TEST(SharedLocalizer, AGuessThatIsNoneIsRefusedAndNotKept) {
  SharedLocalizer localizer{test::swarmConfig()};
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(localizer.relocalizeAt({{kNan, 0.0}, Eigen::Matrix2d::Identity()}), std::invalid_argument);
  EXPECT_THROW(localizer.relocalizeAt({{0.0, 0.0}, -Eigen::Matrix2d::Identity()}), std::invalid_argument);
  EXPECT_NO_THROW(localizer.setMap(test::smallMap()));
}

/// In the small map; empty when it was searched.
std::string refusalOfDisc(const Eigen::Vector2d& centre_m, double radius_m) {
  SharedLocalizer localizer{test::swarmConfig()};
  localizer.setMap(test::smallMap());
  try {
    EXPECT_TRUE(localizer.relocalizeAround(centre_m, radius_m));
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

TEST(SharedLocalizer, ADiscThatIsNoneIsRefusedWithTheReason) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(refusalOfDisc({0.0, 0.0}, 10.0), "");
  for (const double radius_m : {0.0, -1.0, kNan, kInfinity, 1e7}) {
    EXPECT_THAT(refusalOfDisc({0.0, 0.0}, radius_m), testing::HasSubstr("radius")) << radius_m;
  }
  for (const double y_m : {kNan, kInfinity, 1e7}) {
    EXPECT_THAT(refusalOfDisc({0.0, y_m}, 1.0), testing::HasSubstr("centre")) << y_m;
  }
}

TEST(SharedLocalizer, ADiscMustTouchTheMap) {
  EXPECT_EQ(refusalOfDisc({500.0, 0.0}, 600.0), "");
  EXPECT_THAT(refusalOfDisc({500.0, 0.0}, 10.0), testing::HasSubstr("outside the map, which covers x from "));
}

TEST(SharedLocalizer, AGuessMustBeNearTheMap) {
  SharedLocalizer localizer{test::swarmConfig()};
  localizer.setMap(test::smallMap());
  const Eigen::Matrix2d near_m2 = Eigen::Matrix2d::Identity();
  EXPECT_THAT(test::refusalOf<std::invalid_argument>([&] {
                localizer.relocalizeAt({{500.0, 0.0}, near_m2});
              }),
              testing::HasSubstr("the pose lies outside the map, which covers x from "));
  EXPECT_TRUE(localizer.relocalizeAt({{500.0, 0.0}, 200.0 * 200.0 * near_m2}));
}

TEST(SharedLocalizer, AnUnusableImageChangesNothing) {
  SharedLocalizer localizer{test::swarmConfig()};
  localizer.setMap(test::smallMap());
  EXPECT_THROW(localizer.process(kSecond_ns, cv::Mat()), std::invalid_argument);
  EXPECT_THROW(localizer.process(kSecond_ns, cv::Mat(240, 320, CV_8UC3)), std::invalid_argument);
  EXPECT_TRUE(localizer.process(kSecond_ns, noise()).has_value());
}

/// To see whether the particles moved.
std::vector<Eigen::Vector2d> cloudOf(const std::optional<SharedLocalizer::Result>& result) {
  std::vector<Eigen::Vector2d> positions;
  for (const Particle& particle : result->particles) positions.push_back(particle.position_m);
  return positions;
}

TEST(SharedLocalizer, ARepeatedImageGetsTheAnswerItHad) {
  SharedLocalizer localizer{test::swarmConfig()};
  localizer.setMap(test::smallMap());
  const cv::Mat image = noise();
  localizer.process(kSecond_ns, noise());
  const auto first = localizer.process(2 * kSecond_ns, image);
  EXPECT_EQ(cloudOf(localizer.process(2 * kSecond_ns, image.clone())), cloudOf(first));
  EXPECT_NE(cloudOf(localizer.process(2 * kSecond_ns, noise())), cloudOf(first))
      << "the stamp alone does not repeat it";
}

TEST(SharedLocalizer, ARepeatedImageIsLookedAtAnewAfterARelocalization) {
  SharedLocalizer localizer{test::swarmConfig()};
  localizer.setMap(test::smallMap());
  const cv::Mat image = noise();
  const auto first = localizer.process(kSecond_ns, image);
  localizer.relocalizeAnywhere();
  EXPECT_NE(cloudOf(localizer.process(kSecond_ns, image)), cloudOf(first));
  EXPECT_EQ(localizer.doubt(), LocalizationState::kInitializing);
}

TEST(SharedLocalizer, ParametersHoldForThisMapAndForTheNext) {
  SharedLocalizer localizer{test::swarmConfig()};
  LocalizerConfig config = test::swarmConfig();
  config.dpso.particles = 40;
  localizer.setMap(test::smallMap());
  localizer.configure(config);
  EXPECT_EQ(localizer.process(kSecond_ns, noise())->particles.size(), 40U);
  localizer.setMap(test::smallMap());
  EXPECT_EQ(localizer.process(kSecond_ns, noise())->particles.size(), 40U);
  config.dpso.v0 = 2.0;
  EXPECT_THROW(localizer.configure(config), ParameterError);
  EXPECT_EQ(localizer.process(2 * kSecond_ns, noise())->particles.size(), 40U);
}

TEST(SharedLocalizer, ParametersAndMapsMayChangeWhileImagesAreProcessed) {
  SharedLocalizer localizer{test::swarmConfig()};
  localizer.setMap(test::smallMap());
  std::atomic<bool> done{false};
  std::thread replacer([&] {
    while (!done) localizer.setMap(test::smallMap());
  });
  std::thread tuner([&] {
    LocalizerConfig config;
    while (!done) {
      config.tracker = config.tracker == "dpso" ? "pf_linear" : "dpso";
      config.dpso.particles = config.dpso.particles == 80 ? 40 : 80;
      localizer.configure(config);
    }
  });
  for (int i = 1; i <= 20; ++i) EXPECT_TRUE(localizer.process(i * kSecond_ns, noise()).has_value());
  done = true;
  replacer.join();
  tuner.join();
}

TEST(SharedLocalizer, MapsMayBeReplacedWhileImagesAreProcessed) {
  SharedLocalizer localizer{test::swarmConfig()};
  localizer.setMap(test::smallMap());
  std::atomic<bool> done{false};
  std::thread replacer([&] {
    while (!done) {
      localizer.setMap(test::smallMap());
      localizer.relocalizeAnywhere();
    }
  });
  for (int i = 1; i <= 20; ++i) EXPECT_TRUE(localizer.process(i * kSecond_ns, noise()).has_value());
  done = true;
  replacer.join();
}

}  // namespace
}  // namespace visual_localization

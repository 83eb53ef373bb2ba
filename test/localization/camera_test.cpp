#include <functional>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "test/localization/wall_street.h"
#include "test/support/swarm_config.h"
#include "visual_localization/localization/localizer.h"

namespace visual_localization {
namespace {

using test::kSecond;

/// What a broken or badly placed camera makes of a view.
struct Fault {
  const char* name;
  std::function<cv::Mat(const cv::Mat& view, int number)> apply;
};

cv::Mat level(int grey) { return {240, 320, CV_8UC1, cv::Scalar(grey)}; }

cv::Mat exposed(const cv::Mat& view, double gain) {
  cv::Mat image;
  view.convertTo(image, CV_8U, gain);
  return image;
}

cv::Mat blurred(const cv::Mat& view, int length_px) {
  cv::Mat image;
  cv::blur(view, image, cv::Size(length_px, 1));
  return image;
}

cv::Mat soiled(const cv::Mat& view, int radius_px) {
  cv::Mat image = view.clone();
  cv::circle(image, {200, 110}, radius_px, cv::Scalar(25), cv::FILLED);
  return image;
}

/// A drive along the street at an even pace, whose images are spoilt for a while.
class Drive : public test::WallStreet {
 protected:
  static constexpr int kFaultFrom = 18;
  static constexpr int kFaultUntil = 34;
  static constexpr int kImagesInAll = 54;

  struct Step {
    Estimate estimate;
    double error_m = 0.0;
    bool isTracking() const { return estimate.state == LocalizationState::kTracking; }
  };

  static std::vector<Step> drive(const LocalizerConfig& config, const std::function<cv::Mat(int, double)>& camera) {
    Localizer localizer(map(), config);
    std::vector<Step> steps;
    for (int i = 0; i < kImagesInAll; ++i) {
      const Eigen::Vector2d robot(0.6 * i + 0.3, 0.0);
      const Estimate estimate = localizer.process(i * kSecond, camera(i, robot.x()));
      steps.push_back({estimate, (estimate.pose.position_m - robot).norm()});
    }
    return steps;
  }

  static std::vector<Step> drive(const LocalizerConfig& config, const Fault& fault) {
    return drive(config, [&fault](int i, double along_m) {
      const cv::Mat view = viewAt(along_m);
      return noisy(i >= kFaultFrom && i < kFaultUntil ? fault.apply(view, i) : view, i);
    });
  }

  /// Shares of the images from `begin` to `end`.
  static double shareOfTracking(const std::vector<Step>& steps, int begin, int end) {
    int tracking = 0;
    for (int i = begin; i < end; ++i) tracking += steps[static_cast<std::size_t>(i)].isTracking() ? 1 : 0;
    return static_cast<double>(tracking) / (end - begin);
  }

  /// One bad image among good ones is forgiven.
  static void expectSensible(const std::vector<Step>& steps, double wrong_m = 5.0) {
    for (std::size_t i = 0; i < steps.size(); ++i) {
      const bool wrong = steps[i].isTracking() && steps[i].error_m > wrong_m && i != kFaultFrom;
      EXPECT_FALSE(wrong) << "image " << i << ": " << steps[i].error_m;
      EXPECT_TRUE(steps[i].estimate.pose.position_m.allFinite());
      EXPECT_TRUE(steps[i].estimate.pose.covariance_m2.allFinite());
    }
    EXPECT_TRUE(steps[kFaultFrom - 1].isTracking()) << "before the fault";
    EXPECT_TRUE(steps.back().isTracking()) << "after the fault";
  }
};

class EveryChoiceOfFeatures : public Drive, public ::testing::WithParamInterface<std::tuple<const char*, const char*>> {
 protected:
  static LocalizerConfig config() {
    LocalizerConfig config = test::swarmConfig();
    std::tie(config.tracker, config.features) = GetParam();
    return config;
  }
};

INSTANTIATE_TEST_SUITE_P(TrackersAndFeatures, EveryChoiceOfFeatures,
                         ::testing::Combine(::testing::Values("dpso", "dpso_multi", "pf_gaussian"),
                                            ::testing::Values("sift", "global", "hybrid")),
                         [](const auto& combination) {
                           return std::string(std::get<0>(combination.param)) + "_" + std::get<1>(combination.param);
                         });

TEST_P(EveryChoiceOfFeatures, AnImageThatShowsNothingEndsTrackingUntilThereIsSomethingToSee) {
  const std::vector<Fault> faults{
      {"black", [](const cv::Mat&, int) { return level(0); }},
      {"dark", [](const cv::Mat& view, int) { return exposed(view, 0.01); }},
      {"white", [](const cv::Mat&, int) { return level(255); }},
      {"saturated", [](const cv::Mat& view, int) { return exposed(view, 100.0); }},
      {"fog", [](const cv::Mat&, int) { return level(128); }},
      {"noise", [](const cv::Mat&, int number) { return noisy(level(128), number, 40.0); }},
  };
  for (const Fault& fault : faults) {
    SCOPED_TRACE(fault.name);
    const std::vector<Step> steps = drive(config(), fault);
    expectSensible(steps);
    EXPECT_EQ(shareOfTracking(steps, kFaultFrom + 2, kFaultUntil), 0.0);
  }
}

TEST_F(Drive, AScratchyImageIsLocalisedAllTheSame) {
  const std::vector<Fault> faults{
      {"a quarter of the light", [](const cv::Mat& view, int) { return exposed(view, 0.25); }},
      {"a quarter more light", [](const cv::Mat& view, int) { return exposed(view, 1.25); }},
      {"dirt", [](const cv::Mat& view, int) { return soiled(view, 60); }},
      {"motion blur", [](const cv::Mat& view, int) { return blurred(view, 5); }},
      {"noise", [](const cv::Mat& view, int number) { return noisy(view, number, 8.0); }},
  };
  for (const Fault& fault : faults) {
    SCOPED_TRACE(fault.name);
    const std::vector<Step> steps = drive(test::swarmConfig(), fault);
    expectSensible(steps);
    EXPECT_GE(shareOfTracking(steps, kFaultFrom, kFaultUntil), 0.8);
  }
}

TEST_F(Drive, ARuinedImageIsNeverAWrongPosition) {
  constexpr double kView_m = 320.0 * kMetresPerImage / kPixelsPerImage;  // what little is left is seen from so far away
  const std::vector<Fault> faults{
      {"dirt over most of it", [](const cv::Mat& view, int) { return soiled(view, 130); }},
      {"blurred beyond use", [](const cv::Mat& view, int) { return blurred(view, 61); }},
      {"noise beyond use", [](const cv::Mat& view, int number) { return noisy(view, number, 80.0); }},
      {"five times the light", [](const cv::Mat& view, int) { return exposed(view, 5.0); }},
  };
  for (const Fault& fault : faults) {
    SCOPED_TRACE(fault.name);
    expectSensible(drive(test::swarmConfig(), fault), kView_m);
  }
}

/// Stands still at the first image of the fault, while the robot drives on.
cv::Mat frozen(int i, double along_m, cv::Mat& held, const std::function<cv::Mat(double)>& view, int from, int until) {
  if (i <= from || i >= until) held = view(along_m);
  return held.clone();
}

class FrozenCamera : public EveryChoiceOfFeatures {
 protected:
  static std::vector<Step> driveFrozen(const LocalizerConfig& config) {
    cv::Mat held;
    return drive(config, [&held](int i, double along_m) {
      return frozen(
          i, along_m, held, [i](double at_m) { return noisy(viewAt(at_m), i); }, kFaultFrom, kFaultUntil);
    });
  }
};

INSTANTIATE_TEST_SUITE_P(TrackersAndFeatures, FrozenCamera,
                         ::testing::Combine(::testing::Values("dpso", "dpso_multi", "pf_gaussian", "pf_linear"),
                                            ::testing::Values("sift", "global", "hybrid")),
                         [](const auto& combination) {
                           return std::string(std::get<0>(combination.param)) + "_" + std::get<1>(combination.param);
                         });

TEST_P(FrozenCamera, EndsTrackingAndComesBack) {
  const std::vector<Step> steps = driveFrozen(config());
  expectSensible(steps);
  for (int i = kFaultFrom + 1; i < kFaultUntil; ++i) {
    const Estimate& estimate = steps[static_cast<std::size_t>(i)].estimate;
    const int repeats = i - kFaultFrom;
    EXPECT_EQ(estimate.repeats, static_cast<std::size_t>(repeats));
    EXPECT_EQ(estimate.frozen, repeats >= 3);
    EXPECT_EQ(estimate.state, repeats >= 3 ? LocalizationState::kUncertain : LocalizationState::kTracking) << repeats;
    EXPECT_EQ(estimate.stamp_ns, i * kSecond);
    EXPECT_EQ(estimate.pose.position_m, steps[kFaultFrom].estimate.pose.position_m) << "no new evidence";
  }
  EXPECT_EQ(steps[kFaultUntil].estimate.repeats, 0U);
  EXPECT_FALSE(steps[kFaultUntil].estimate.frozen);
  for (int i = kFaultUntil; i < kFaultUntil + 3; ++i) {
    EXPECT_FALSE(steps[static_cast<std::size_t>(i)].isTracking()) << "four images must confirm the position";
  }
}

TEST_F(Drive, ImagesThatComeTwiceDoNotDisturb) {
  cv::Mat held;
  const std::vector<Step> steps = drive(test::swarmConfig(), [&held](int i, double along_m) {
    if (i % 3 == 0) held = noisy(viewAt(along_m), i);
    return held;
  });
  for (std::size_t i = 30; i < steps.size(); ++i) {
    EXPECT_TRUE(steps[i].isTracking()) << i;
    EXPECT_LT(steps[i].error_m, 3.0) << i;
  }
}

TEST_F(Drive, AStreamThatRepeatsEachImageToReachItsRateIsNotFrozen) {
  Localizer localizer(map(), test::swarmConfig());
  bool tracking = false;
  for (int i = 0; i < 12; ++i) {
    const cv::Mat view = noisy(viewAt(10.0 + 0.3 * i), i);
    for (int j = 0; j < 6; ++j) {
      const Estimate estimate = localizer.process(i * kSecond / 2 + j * kSecond / 12, view);
      EXPECT_FALSE(estimate.frozen) << i << " " << j;
      tracking = estimate.state == LocalizationState::kTracking;
    }
  }
  EXPECT_TRUE(tracking);
}

TEST_F(Drive, AnImageThatIsSentAgainWithItsStampIsTheSameImageUntilTheDriverMustBeStuck) {
  Localizer localizer(map(), test::swarmConfig());
  for (int i = 0; i < 10; ++i) localizer.process(i * kSecond, noisy(viewAt(10.0 + 0.3 * i), i));
  const cv::Mat last = noisy(viewAt(13.0), 10);
  const Estimate first = localizer.process(10 * kSecond, last);
  ASSERT_EQ(first.state, LocalizationState::kTracking);
  for (int i = 0; i < 29; ++i) {
    const Estimate again = localizer.process(10 * kSecond, last);
    EXPECT_EQ(again.state, LocalizationState::kTracking) << i;
    EXPECT_EQ(again.pose.position_m, first.pose.position_m);
  }
  EXPECT_TRUE(localizer.process(10 * kSecond, last).frozen);
}

TEST_F(Drive, WhatIsDoubtedHasTheCovarianceOfTheWholeCloud) {
  Localizer localizer(map(), test::swarmConfig());
  Estimate estimate;
  cv::Mat view;
  for (int i = 0; i < 10; ++i) estimate = localizer.process(i * kSecond, view = noisy(viewAt(10.0 + 0.3 * i), i));
  ASSERT_EQ(estimate.state, LocalizationState::kTracking);
  localizer.doubt();
  const Estimate again = localizer.process(9 * kSecond + kSecond / 5, view);
  EXPECT_EQ(again.state, LocalizationState::kUncertain);
  EXPECT_GT(again.pose.covariance_m2.trace(), estimate.pose.covariance_m2.trace());
}

TEST_F(Drive, ASimulatedCameraWithoutNoiseMayStandStillWhenAskedTo) {
  LocalizerConfig config = test::swarmConfig();
  const auto standing = [](int, double) { return viewAt(12.0); };
  EXPECT_EQ(shareOfTracking(drive(config, standing), 0, kImagesInAll), 0.0);
  config.state.frozen_images = 0;
  const std::vector<Step> steps = drive(config, standing);
  EXPECT_TRUE(steps.back().isTracking());
  EXPECT_NEAR(steps.back().estimate.pose.position_m.x(), 12.0, 1.5);
  EXPECT_EQ(steps.back().estimate.repeats, static_cast<std::size_t>(kImagesInAll - 1));
  EXPECT_FALSE(steps.back().estimate.frozen);
}

TEST_F(Drive, AFrozenImageIsLookedAtAnewAfterARelocalizationButIsNoPosition) {
  Localizer localizer(map(), test::swarmConfig());
  const cv::Mat view = viewAt(12.0);
  for (int i = 0; i < 5; ++i) localizer.process(i * kSecond, view);
  localizer.relocalize(around({30.0, 0.0}, 3.0));
  const Estimate estimate = localizer.process(5 * kSecond, view);
  EXPECT_NEAR(estimate.pose.position_m.x(), 30.0, 3.0);
  EXPECT_TRUE(estimate.frozen);
  EXPECT_EQ(estimate.state, LocalizationState::kInitializing);
}

}  // namespace
}  // namespace visual_localization

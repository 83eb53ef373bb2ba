// Several sessions in one map, each with the camera that recorded it.

#include <algorithm>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "test/map/straight_round.h"
#include "visual_localization/map/map_builder.h"

namespace visual_localization {
namespace {

using test::kSecond_ns;
using test::scene;
using test::straightRound;

TEST(MapBuilder, RoundsBecomeSessionsOfOneMap) {
  MapBuilder builder({});
  for (const char* name : {"first", "second"}) {
    builder.beginSession(name, straightRound());
    for (int i = 0; i < 3; ++i) {
      ASSERT_TRUE(builder.wants(i * kSecond_ns));
      builder.addImage(i * kSecond_ns, scene(1, 3 * i));
    }
  }
  const auto map = builder.build();
  EXPECT_EQ(map->size(), 6U);
  EXPECT_EQ(map->pose(2).session, 0);
  EXPECT_EQ(map->pose(3).session, 1);
}

TEST(MapBuilder, ARoundIsPrunedAsIfItWereAlone) {
  const auto add = [](MapBuilder& builder, const char* name, std::uint64_t seed) {
    builder.beginSession(name, straightRound());
    for (int i = 0; i < 7; ++i) builder.addImage(i * kSecond_ns, scene(seed, 4 * i));
  };
  MapBuilder alone({});
  add(alone, "sunny", 1);
  MapBuilder together({});
  add(together, "sunny", 1);
  add(together, "cloudy", 2);       // shows nothing of the same
  add(together, "sunny again", 1);  // shows exactly the same
  const auto one = alone.build();
  const auto three = together.build();
  ASSERT_EQ(three->size(), 3 * one->size());
  for (std::size_t i = 0; i < one->size(); ++i) {
    EXPECT_EQ(three->local(i)->bytes(), one->local(i)->bytes());
    EXPECT_EQ(three->featureCount(2 * one->size() + i), one->featureCount(i));
  }
}

TEST(MapBuilder, RoundsShareTheFrameOfTheFirst) {
  // The second one begins 2.8 m farther east, so with another first fix.
  const std::vector<Fix> fixes = straightRound();
  std::vector<Fix> second(fixes.begin() + 20, fixes.end());
  MapBuilder builder({});
  builder.beginSession("first", fixes);
  builder.addImage(6 * kSecond_ns, scene(1, 0));
  builder.beginSession("second", second);
  builder.addImage(6 * kSecond_ns, scene(1, 0));
  const auto map = builder.build();
  EXPECT_NEAR((map->position_m(0) - map->position_m(1)).norm(), 0.0, 0.05);
  EXPECT_NEAR(map->position_m(1).x(), 4.2, 0.05);
}

TEST(MapBuilder, CountsTheImagesOfEachRound) {
  MapBuilder builder({});
  builder.beginSession("first", straightRound());
  builder.addImage(1 * kSecond_ns, scene(1, 0));
  builder.addImage(2 * kSecond_ns, scene(1, 3));
  builder.beginSession("second", straightRound());
  cv::Mat wide;
  cv::resize(scene(1, 0), wide, {640, 200});
  builder.addImage(1 * kSecond_ns, wide);
  const auto& sessions = builder.report().session_images;
  ASSERT_EQ(sessions.size(), 2U);
  EXPECT_EQ(sessions[0].kept, 2U);
  EXPECT_EQ(sessions[0].recorded, cv::Size(320, 240));
  EXPECT_EQ(sessions[1].name, "second");
  EXPECT_EQ(sessions[1].recorded, cv::Size(640, 200));
}

TEST(MapBuilder, ARoundOfAnotherCityIsRefused) {
  // The other side of the earth lies at the datum again for a tangent plane.
  for (const GeodeticPoint& city : {GeodeticPoint{52.5, 13.4, 30.0}, GeodeticPoint{-48.5, 9.05 - 180.0, 0.0}}) {
    const LocalFrame frame(city);
    std::vector<Fix> fixes = straightRound();
    for (std::size_t i = 0; i < fixes.size(); ++i) {
      fixes[i].position = frame.toGeodetic({0.14 * static_cast<double>(i), 0.0});
    }
    MapBuilder builder({});
    builder.beginSession("here", straightRound());
    builder.addImage(kSecond_ns, scene(1, 0));
    try {
      builder.beginSession("there", fixes);
      ADD_FAILURE() << "accepted";
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), testing::AllOf(testing::HasSubstr("'there'"), testing::HasSubstr(" km away")));
    }
    EXPECT_EQ(builder.build()->size(), 1U) << "what came before stays";
  }
}

/// What the builder answers to a session with these fixes. One that is refused leaves no trace.
std::string refusalOf(const std::vector<Fix>& fixes) {
  MapBuilder builder({});
  std::string refusal = "accepted";
  try {
    builder.beginSession("stuck", fixes);
  } catch (const std::runtime_error& error) {
    refusal = error.what();
  }
  builder.beginSession("good", straightRound());
  builder.addImage(kSecond_ns, scene(1, 0));
  EXPECT_EQ(builder.build()->header().sessions.size(), refusal == "accepted" ? 2U : 1U);
  EXPECT_NEAR(builder.frame().datum().latitude_deg, straightRound().front().position.latitude_deg, 1e-6);
  return refusal;
}

TEST(MapBuilder, AReceiverThatIsStuckIsRefused) {
  std::vector<Fix> stuck = straightRound();
  for (Fix& fix : stuck) fix.position = {52.5, 13.4, 30.0};
  EXPECT_THAT(refusalOf(stuck),
              testing::StartsWith("session 'stuck': its 40 believable fixes of 40 are all at one point"));
  stuck[7].position.latitude_deg += 0.01;  // an outlier is no motion
  EXPECT_THAT(refusalOf(stuck), testing::HasSubstr("are all at one point"));
  for (Fix& fix : stuck) fix.position = {0.0, 0.0, 0.0};
  EXPECT_THAT(refusalOf(stuck), testing::HasSubstr("none of its 40 fixes is valid"));
}

TEST(MapBuilder, FixesAtTheOriginAreNone) {
  std::vector<Fix> fixes = straightRound();
  for (std::size_t i = 0; i < 25; ++i) fixes[i].position = {0.0, 0.0, 0.0};  // the receiver starts
  MapBuilder builder({});
  builder.beginSession("round", fixes);
  EXPECT_FALSE(builder.wants(kSecond_ns));
  EXPECT_TRUE(builder.wants(6 * kSecond_ns));
  EXPECT_EQ(builder.report().sessions.front().verdicts.front(), FixVerdict::kNoFix);
  EXPECT_EQ(builder.report().sessions.front().verdicts.back(), FixVerdict::kKept);
}

SessionCamera exampleCamera(cv::Size size) {
  cv::Mat grey(size, CV_8U, cv::Scalar(255));
  grey.rowRange(size.height / 2, size.height).setTo(0);
  const CameraModel model({{320, 240}, 266.0, 267.0, 159.5, 119.5, Distortion::kPlumbBob, {-0.1, 0.01, 0.0, 0.0}});
  return {model.scaledTo(size), Mask(grey)};
}

TEST(MapBuilder, CameraAndMaskAreScaledWithTheImages) {
  MapBuilder builder({});
  builder.beginSession("first", straightRound());
  builder.addImage(1 * kSecond_ns, scene(1, 0));
  builder.beginSession("second", straightRound(), exampleCamera({640, 480}));
  cv::Mat large;
  cv::resize(scene(1, 0), large, {640, 480});
  builder.addImage(1 * kSecond_ns, large);
  const auto map = builder.build();
  const std::vector<Session>& sessions = map->header().sessions;
  EXPECT_FALSE(sessions[0].camera);
  EXPECT_TRUE(sessions[0].mask.empty());
  EXPECT_EQ(sessions[1].camera, exampleCamera({640, 480}).model->scaledTo({320, 240}));
  EXPECT_TRUE(sessions[1].mask == exampleCamera({320, 240}).mask);
  ASSERT_GT(map->local(0)->size(), 10U);
  ASSERT_GT(map->local(1)->size(), 10U);
  float lowest_px = 0.0F;
  for (const Keypoint& keypoint : map->local(0)->keypoints()) lowest_px = std::max(lowest_px, keypoint.y_px);
  EXPECT_GT(lowest_px, 150.0F);
  for (const Keypoint& keypoint : map->local(1)->keypoints()) EXPECT_LT(keypoint.y_px, 120.0F);
}

TEST(MapBuilder, ACameraForImagesOfAnotherShapeIsRefused) {
  for (const bool mask : {false, true}) {
    SessionCamera camera = exampleCamera({320, 200});
    if (mask) camera.model.reset();
    MapBuilder builder({});
    builder.beginSession("round", straightRound(), camera);
    try {
      builder.addImage(1 * kSecond_ns, scene(1, 0));
      FAIL() << "accepted";
    } catch (const CameraError& error) {
      EXPECT_THAT(error.what(), testing::AllOf(testing::HasSubstr("session 'round'"),
                                               testing::HasSubstr("320 x 200 px, but the images have 320 x 240 px")));
    }
  }
}

}  // namespace
}  // namespace visual_localization

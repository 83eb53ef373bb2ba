#include "survey/map_survey.h"

#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "test/support/example_map.h"
#include "test/support/stamps.h"

namespace visual_localization {
namespace {

using test::kSecond_ns;

/// Collects images of a map.
class Rounds {
 public:
  /// Images a metre apart from `from_m` on, heading that way.
  Rounds& drive(int session, Eigen::Vector2d from_m, double yaw_rad, std::size_t count, std::size_t features = 100) {
    std::mt19937 random(1);
    for (std::size_t i = 0; i < count; ++i) {
      TrainingImage image;
      image.stamp_ns = static_cast<std::int64_t>(images_.size()) * kSecond_ns;
      image.session = session;
      image.position_m = from_m + static_cast<double>(i) * Eigen::Vector2d(std::cos(yaw_rad), std::sin(yaw_rad));
      image.yaw_rad = yaw_rad;
      image.sift = test::randomFeatures(features, random);
      images_.push_back(image);
    }
    return *this;
  }
  std::shared_ptr<const TrainingMap> map() const {
    MapHeader header = test::exampleHeader();
    header.sessions = {{"first"}, {"second"}, {"third"}};
    return std::make_shared<const TrainingMap>(header, images_);
  }

 private:
  std::vector<TrainingImage> images_;
};

TEST(Octant, EastNorthWestSouth) {
  EXPECT_EQ(octantOf(0.0), 0);
  EXPECT_EQ(octantOf(kPi / 2.0), 2);
  EXPECT_EQ(octantOf(kPi), 4);
  EXPECT_EQ(octantOf(-kPi), 4);
  EXPECT_EQ(octantOf(-kPi / 2.0), 6);
  EXPECT_EQ(octantOf(-0.3), 0);
  EXPECT_EQ(octantOf(1e300) >= 0 && octantOf(1e300) < kOctants, true);
}

TEST(MapSurvey, ARoundByItself) {
  const MapSurvey found = survey(*Rounds().drive(0, {0, 0}, 0.0, 41).drive(0, {40, 1}, kPi / 2.0, 20).map());
  EXPECT_EQ(found.sessions[0].images, 61U);
  EXPECT_EQ(found.sessions[0].first_ns, 0);
  EXPECT_EQ(found.sessions[0].last_ns, 60 * kSecond_ns);
  EXPECT_EQ(found.sessions[1].images, 0U);
  EXPECT_DOUBLE_EQ(found.sessions[0].path_m, 60.0);
  EXPECT_DOUBLE_EQ(found.driven_m, 60.0);
  EXPECT_DOUBLE_EQ(found.route_m, 60.0);
  EXPECT_DOUBLE_EQ(found.shared_m, 0.0);
  EXPECT_DOUBLE_EQ(found.heading_m[0], 40.0);
  EXPECT_DOUBLE_EQ(found.heading_m[2], 20.0);
  EXPECT_DOUBLE_EQ(std::accumulate(found.heading_m.begin(), found.heading_m.end(), 0.0), found.driven_m);
  EXPECT_DOUBLE_EQ(found.one_way_m, 60.0);
  EXPECT_DOUBLE_EQ(found.median_step_m, 1.0);
  EXPECT_EQ(found.gaps, 0U);
}

TEST(MapSurvey, WhatTwoSessionsSeeIsOneRoute) {
  // The second one drives the last 20 m again, a metre beside, and 30 m beyond.
  const MapSurvey found = survey(*Rounds().drive(0, {0, 0}, 0.0, 41).drive(1, {20, 1}, 0.0, 51).map());
  EXPECT_DOUBLE_EQ(found.driven_m, 90.0);
  EXPECT_NEAR(found.route_m, 70.0, 5.0);
  EXPECT_NEAR(found.shared_m, 20.0, 5.0);
  EXPECT_DOUBLE_EQ(found.sessions[0].driven_m, 40.0);
  EXPECT_DOUBLE_EQ(found.sessions[1].driven_m, 50.0);
  EXPECT_NEAR(found.sessions[0].shared_m, 20.0, 5.0);
  EXPECT_NEAR(found.sessions[1].shared_m, 20.0, 5.0);
}

TEST(MapSurvey, TheOtherDirectionIsAnotherRoute) {
  // There and 10 m back.
  const MapSurvey found = survey(*Rounds().drive(0, {0, 0}, 0.0, 41).drive(1, {40, 0.5}, kPi, 11).map());
  EXPECT_DOUBLE_EQ(found.route_m, 50.0);
  EXPECT_DOUBLE_EQ(found.shared_m, 0.0);
  EXPECT_NEAR(found.one_way_m, 30.0, 5.0);
  ASSERT_EQ(found.one_way.size(), 1U);
  EXPECT_EQ(found.one_way[0].session, 0);
  EXPECT_EQ(found.one_way[0].first, 0U);
}

TEST(MapSurvey, AGapIsNoRoute) {
  const auto map = Rounds().drive(0, {0, 0}, 0.0, 11).drive(0, {60, 0}, 0.0, 11).map();
  const MapSurvey found = survey(*map);
  EXPECT_DOUBLE_EQ(found.sessions[0].path_m, 70.0);
  EXPECT_DOUBLE_EQ(found.route_m, 20.0);
  EXPECT_EQ(found.gaps, 1U);
  ASSERT_FALSE(found.longest_steps.empty());
  EXPECT_EQ(found.longest_steps[0].from, 10U);
  EXPECT_EQ(found.longest_steps[0].to, 11U);
  EXPECT_DOUBLE_EQ(found.longest_steps[0].length_m, 50.0);
  EXPECT_LE(found.longest_steps.size(), SurveyConfig().most_listed);
  EXPECT_EQ(found.one_way.size(), 2U) << "a gap ends a stretch";
}

TEST(MapSurvey, FewFeaturesAreWeakUnlessAnotherSessionSeesMore) {
  const auto map = Rounds()
                       .drive(0, {0, 0}, 0.0, 10)
                       .drive(0, {10, 0}, 0.0, 5, 30)
                       .drive(0, {15, 0}, 0.0, 25)
                       .drive(0, {40, 0}, 0.0, 3, 7)
                       .drive(1, {0, 1}, 0.0, 30)
                       .map();
  const MapSurvey found = survey(*map);
  EXPECT_EQ(found.weak_images, 8U);
  ASSERT_EQ(found.weak.size(), 2U);
  EXPECT_EQ(found.weak[0].first, 10U);
  EXPECT_EQ(found.weak[0].last, 14U);
  EXPECT_EQ(found.weak[0].images, 5U);
  EXPECT_EQ(found.weak[0].least_features, 30U);
  EXPECT_DOUBLE_EQ(found.weak[0].length_m, 4.0);
  EXPECT_EQ(found.weak[0].seen_elsewhere, 5U);
  EXPECT_EQ(found.weak[1].least_features, 7U);
  EXPECT_EQ(found.weak[1].seen_elsewhere, 0U) << "only its own session has sound images near";
  SurveyConfig strict;
  strict.few_features = 7;
  EXPECT_EQ(survey(*map, strict).weak_images, 0U);
}

TEST(MapSurvey, ManySessionsThatAlternateTakeNoLonger) {
  MapHeader header = test::exampleHeader();
  header.sessions.assign(5000, {"s"});
  std::vector<TrainingImage> images(50000);
  for (std::size_t i = 0; i < images.size(); ++i) {
    images[i].session = static_cast<int>(i % 5000);
    images[i].position_m = {i % 2 == 0 ? 1e6 : -1e6, -1e6};
  }
  const MapSurvey found = survey(TrainingMap(header, std::move(images)));
  EXPECT_EQ(found.weak.size(), 5000U);
  EXPECT_EQ(found.cells, 2U);
  EXPECT_EQ(found.weak_images, 50000U);
}

TEST(MapSurvey, OneImage) {
  const MapSurvey found = survey(*Rounds().drive(1, {3, 4}, 1.0, 1).map());
  EXPECT_EQ(found.route_m, 0.0);
  EXPECT_TRUE(found.longest_steps.empty());
  EXPECT_EQ(found.cells, 1U);
}

}  // namespace
}  // namespace visual_localization

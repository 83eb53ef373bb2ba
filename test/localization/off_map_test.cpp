#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "localization/place_filter.h"
#include "test/support/stamps.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {
namespace {

using test::kSecond_ns;

constexpr std::size_t kStreetImages = 100;
constexpr double kEnd_m = 1.0 * (kStreetImages - 1);

/// An image a metre and a second, on the east axis; or on a ring of the same length.
std::shared_ptr<const TrainingMap> longStreet(bool ring = false) {
  MapHeader header;
  header.image_size = {320, 240};
  header.sessions.push_back({"street"});
  std::vector<TrainingImage> images(kStreetImages);
  for (std::size_t i = 0; i < kStreetImages; ++i) {
    const double way_m = 1.0 * static_cast<double>(i);
    const double radius_m = kStreetImages / (2.0 * M_PI);
    images[i].stamp_ns = static_cast<std::int64_t>(i + 1000) * kSecond_ns;
    images[i].position_m = {way_m, 0.0};
    if (!ring) continue;
    images[i].position_m = radius_m * Eigen::Vector2d(std::cos(way_m / radius_m), std::sin(way_m / radius_m));
    images[i].yaw_rad = way_m / radius_m + M_PI / 2.0;
  }
  return std::make_shared<const TrainingMap>(header, std::move(images));
}

/// Drives along the map; the matches of other places vary as by chance.
class StreetDrive {
 public:
  explicit StreetDrive(std::shared_ptr<const TrainingMap> map) : map_(std::move(map)), filter_(*map_, {}) {}

  /// A second on; the training image `place` and those beside it match best: `matches`.
  void see(std::size_t place, std::size_t matches, const Motion& motion = Motion(1.0)) {
    filter_.predict(motion);
    PlaceLikelihood likelihood;
    for (std::size_t i = 0; i < kStreetImages; ++i) {
      const auto apart = static_cast<double>(std::max(i, place) - std::min(i, place));
      Score score;
      score.matches = 3 + (i * 7 + 3 * images_) % 4;
      const double there = static_cast<double>(matches) * std::exp(-0.2 * apart * apart);
      score.matches = std::max(score.matches, static_cast<std::size_t>(there));
      likelihood.compared.push_back(filter_.comparedWith(i, score));
    }
    likelihood.elsewhere = 100.0;
    filter_.update(likelihood);
    ++images_;
  }
  void goTo(std::size_t from, std::size_t to, std::size_t matches) {
    for (std::size_t i = from; i < to; ++i) see(i, matches);
  }
  void seeNothingKnown(int images) {
    for (int i = 0; i < images; ++i) see(0, 0);
  }
  double offMap() const { return filter_.offMap(); }
  PlaceFilter& filter() { return filter_; }

 private:
  std::shared_ptr<const TrainingMap> map_;
  PlaceFilter filter_;
  std::size_t images_ = 0;
};

TEST(OffMap, IsOpenBeforeTheFirstImage) {
  StreetDrive drive(longStreet());
  const double in_map = kStreetImages / static_cast<double>(drive.filter().places().size());
  EXPECT_NEAR(drive.offMap(), 1.0 - OffMapBelief::kUnknown * in_map, 1e-9);
}

TEST(OffMap, IsUnlikelyWhereThePlacesFollowEachOther) {
  for (const std::size_t matches : {12, 60, 200}) {
    StreetDrive drive(longStreet());
    drive.goTo(10, 40, matches);
    EXPECT_LT(drive.offMap(), 0.01) << matches;
  }
}

TEST(OffMap, TheEndStillMatchesBeyondItButLess) {
  StreetDrive drive(longStreet());
  drive.goTo(40, kStreetImages, 100);
  ASSERT_LT(drive.offMap(), 0.03);
  // The same scenery from farther and farther behind the last image, as a camera that looks ahead has it.
  for (const std::size_t matches : {80, 65, 55, 48, 42, 38, 34, 30}) drive.see(kStreetImages - 1, matches);
  EXPECT_GT(drive.offMap(), 0.9);
  EXPECT_LT(drive.filter().probabilityWithin({kEnd_m, 0.0}, 3.0), 0.1) << "it went on";
}

TEST(OffMap, ARobotMayStopAheadOfTheEnd) {
  constexpr std::size_t kHere = kStreetImages - 10;
  StreetDrive drive(longStreet());
  drive.goTo(40, kHere, 100);
  for (int i = 0; i < 3; ++i) drive.see(kHere, 100);
  for (int i = 0; i < 60; ++i) {
    drive.see(kHere, 100);
    EXPECT_LT(drive.offMap(), 0.03) << i;
  }
}

// The end looks the same from some metres behind it.
TEST(OffMap, ARobotThatStopsAtTheEndMayHaveDrivenOn) {
  StreetDrive drive(longStreet());
  drive.goTo(40, kStreetImages, 100);
  for (int i = 0; i < 10; ++i) drive.see(kStreetImages - 1, 100);
  EXPECT_LT(drive.filter().probabilityWithin({kEnd_m, 0.0}, 5.0), 0.97);
}

// How far odometry is believed is learnt on the way there; wheels that turn on the spot are found out.
TEST(OffMap, OdometryTellsARobotThatDocksAtTheEnd) {
  const auto driven = [](double metres) { return Motion(1.0, OdometryIncrement{{metres, 0.0}, 0.0, metres}); };
  const auto inMapAfterDocking = [&](double said_m) {
    StreetDrive drive(longStreet());
    for (std::size_t i = 40; i < kStreetImages; ++i) drive.see(i, 100, driven(said_m));
    for (int i = 0; i < 10; ++i) drive.see(kStreetImages - 1, 100, driven(0.0));
    return drive.filter().probabilityWithin({kEnd_m, 0.0}, 5.0);
  };
  EXPECT_GT(inMapAfterDocking(1.0), 0.97);
  EXPECT_LT(inMapAfterDocking(3.0), 0.97) << "it was wrong all the way";
}

TEST(OffMap, AClosedRoundHasNoEnd) {
  StreetDrive drive(longStreet(true));
  drive.goTo(60, kStreetImages, 100);
  EXPECT_LT(drive.offMap(), 0.01);
  drive.goTo(0, 20, 100);
  EXPECT_LT(drive.offMap(), 0.01);
}

TEST(OffMap, WhatMatchesAsByChanceShowsNoPlace) {
  StreetDrive drive(longStreet());
  drive.goTo(10, 40, 60);
  drive.seeNothingKnown(2);
  EXPECT_LT(drive.offMap(), 0.5) << "somebody passes";
  drive.seeNothingKnown(6);
  EXPECT_GT(drive.offMap(), 0.9);
  drive.goTo(50, 60, 60);
  EXPECT_LT(drive.offMap(), 0.03) << "it is back";
}

TEST(OffMap, AnUnknownStartElsewhereIsNotInTheMap) {
  StreetDrive drive(longStreet());
  drive.seeNothingKnown(20);
  EXPECT_GT(drive.offMap(), 0.9);
}

TEST(OffMap, APoseByLandmarksRulesItOut) {
  StreetDrive drive(longStreet());
  drive.seeNothingKnown(20);
  drive.filter().update(drive.filter().around({30.0, 0.0}));
  EXPECT_NEAR(drive.offMap(), OffMapBelief::kHardly, 1e-3) << "and beyond the ends hardly either";
}

// Far landmarks verify poses for some metres beyond the end, and then fail; the end still matches.
TEST(OffMap, VerifiedPosesLeadBeyondTheEnd) {
  StreetDrive drive(longStreet());
  Fitness seen;
  seen.training_image = kStreetImages - 1;
  seen.score.matches = 100;
  for (double x_m = 80.0; x_m <= kEnd_m + 6.0; x_m += 1.0) {
    drive.filter().predict(Motion(1.0));
    drive.filter().update(drive.filter().around({x_m, 0.0}, seen));
  }
  EXPECT_GT(drive.offMap(), 0.9);
  EXPECT_GT(drive.filter().probabilityWithin({kEnd_m + 6.0, 0.0}, 3.0), 0.9) << "where landmarks say";
  for (int i = 0; i < 20; ++i) {
    drive.see(kStreetImages - 1, 30);
    EXPECT_LT(drive.filter().probabilityWithin({kEnd_m, 0.0}, 5.0), 0.5) << i;
  }
}

TEST(OffMap, APoseFarAsideIsNotInTheMap) {
  StreetDrive drive(longStreet());
  drive.goTo(10, 40, 60);
  drive.filter().update(drive.filter().around({40.0, 20.0}));
  EXPECT_GT(drive.offMap(), 0.9);
}

TEST(OffMap, AfterAPoseTheRightPlaceIsKnownByItsMatches) {
  const auto offMapAfter = [](std::size_t matches_at_pose) {
    StreetDrive drive(longStreet());
    drive.see(10, 60);
    Fitness seen;
    seen.score.matches = matches_at_pose;
    for (std::size_t i = 11; i < kStreetImages; ++i) {
      seen.training_image = i;
      drive.filter().predict(Motion(1.0));
      drive.filter().update(drive.filter().around({1.0 * static_cast<double>(i), 0.0}, seen));
    }
    drive.see(kStreetImages - 1, 30);
    return drive.offMap();
  };
  EXPECT_GT(offMapAfter(200), offMapAfter(30) + 0.1) << "where 200 matched, 30 are of farther away";
}

TEST(OffMap, ADriveThatStartsAheadOfTheMapComesIntoIt) {
  StreetDrive drive(longStreet());
  for (const std::size_t matches : {20, 24, 30, 36, 43, 52, 60}) {
    drive.see(0, matches);
    EXPECT_LT(drive.filter().probabilityWithin({0.0, 0.0}, 3.0), 0.97) << matches;
  }
  drive.goTo(1, 8, 80);
  EXPECT_GT(drive.filter().probabilityWithin({7.0, 0.0}, 3.0), 0.97);
}

TEST(OffMap, ATrainingImageThatIsAskedTwiceCountsOnce) {
  const auto offMapAfter = [](bool twice) {
    StreetDrive drive(longStreet());
    drive.goTo(10, 40, 60);
    PlaceFilter& filter = drive.filter();
    filter.reset({{40.0, 0.0}});
    PlaceLikelihood likelihood;
    Score score;
    score.matches = 5;
    likelihood.compared.push_back(filter.comparedWith(40, score));
    likelihood.asked_in_turn = 1;
    likelihood.compared.push_back(filter.comparedWith(twice ? 40 : 90, score));
    filter.update(likelihood);
    return filter.offMap();
  };
  EXPECT_NEAR(offMapAfter(true), offMapAfter(false), 1e-6);
}

TEST(OffMap, GlobalFeaturesSayNothing) {
  StreetDrive drive(longStreet());
  const double before = drive.offMap();
  Score score;
  score.weight = 0.9;  // without matches
  PlaceLikelihood likelihood;
  likelihood.compared.push_back(drive.filter().comparedWith(3, score));
  drive.filter().update(likelihood);
  EXPECT_NEAR(drive.offMap(), before, 1e-3) << "but where in the map, and beyond its ends";
}

TEST(OffMap, OdometryLeadsBeyondTheEnd) {
  StreetDrive drive(longStreet());
  drive.filter().reset({{kEnd_m, 0.0}});
  drive.filter().predict(Motion(1.0, OdometryIncrement{{10.0, 0.0}, 0.0, 10.0}));
  EXPECT_GT(drive.offMap(), 0.5);
  drive.filter().reset({{50.0, 0.0}});
  drive.filter().predict(Motion(1.0, OdometryIncrement{{10.0, 0.0}, 0.0, 10.0}));
  EXPECT_LT(drive.offMap(), 0.05);
}

}  // namespace
}  // namespace visual_localization

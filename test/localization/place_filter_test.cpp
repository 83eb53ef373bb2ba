#include "localization/place_filter.h"

#include <cmath>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "test/support/stamps.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {
namespace {

using test::kSecond_ns;

/// A session on the east axis: an image a metre and a second.
std::vector<TrainingImage> streetSession(std::size_t count, int session = 0) {
  std::vector<TrainingImage> images(count);
  for (std::size_t i = 0; i < count; ++i) {
    images[i].stamp_ns = static_cast<std::int64_t>(i + 1000) * kSecond_ns;
    images[i].session = session;
    images[i].position_m = {1.0 * static_cast<double>(i), 0.2 * session};
  }
  return images;
}

std::shared_ptr<const TrainingMap> mapOf(std::vector<TrainingImage> images, std::size_t sessions = 1) {
  MapHeader header;
  header.image_size = {320, 240};
  for (std::size_t i = 0; i < sessions; ++i) header.sessions.push_back({"session " + std::to_string(i)});
  return std::make_shared<const TrainingMap>(header, std::move(images));
}

/// All training images compared; those near `position_m` match better than the others.
PlaceLikelihood seenFrom(const TrainingMap& map, double east_m, double at_best = 100.0) {
  PlaceLikelihood likelihood;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const double offset_m = map.position_m(i).x() - east_m;
    likelihood.compared.push_back({i, 1.0 + at_best * std::exp(-0.5 * offset_m * offset_m)});
  }
  return likelihood;
}

double sumOf(const PlaceFilter& filter) {
  return filter.probabilities().sum([](const auto& place) { return place.probability; });
}

Motion afterSeconds(double seconds) { return Motion(seconds); }

TEST(PlaceFilter, TheMassIsOne) {
  const auto map = mapOf(streetSession(80));
  PlaceFilter filter(*map, {});
  EXPECT_NEAR(sumOf(filter), 1.0, 1e-12);
  for (int i = 0; i < 100; ++i) {
    filter.predict(afterSeconds(i % 7 == 0 ? 0.0 : 1.0));
    EXPECT_NEAR(sumOf(filter), 1.0, 1e-9);
    filter.update(i % 5 == 0 ? PlaceLikelihood() : seenFrom(*map, 0.7 * i));
    EXPECT_NEAR(sumOf(filter), 1.0, 1e-9);
  }
}

TEST(PlaceFilter, MovesAsTheSessionDid) {
  const auto map = mapOf(streetSession(80));
  PlaceFilter filter(*map, {});
  filter.reset({{20.0, 0.0}});
  filter.predict(afterSeconds(1.0));
  EXPECT_NEAR(filter.mode().mean_m.x(), 21.0, 0.3);
  filter.reset({{20.0, 0.0}});
  filter.predict(afterSeconds(5.0));
  EXPECT_NEAR(filter.mode().mean_m.x(), 25.0, 1.5);
}

TEST(PlaceFilter, LearnsAnotherSpeed) {
  const auto map = mapOf(streetSession(200));
  for (const double speed_mps : {0.0, 0.5, 1.0, 2.0}) {
    PlaceFilter filter(*map, {});
    filter.reset({{10.0, 0.0}});
    double east_m = 10.0;
    for (int i = 0; i < 40; ++i) {
      east_m += speed_mps;
      filter.predict(afterSeconds(1.0));
      filter.update(seenFrom(*map, east_m));
    }
    EXPECT_NEAR(filter.speed_mps(100), speed_mps, 0.2 + 0.2 * speed_mps);
    const double before_m = filter.mode().mean_m.x();
    filter.predict(afterSeconds(1.0));
    EXPECT_NEAR(filter.mode().mean_m.x() - before_m, speed_mps, 0.3 + 0.25 * speed_mps);
  }
}

TEST(PlaceFilter, OdometrySaysHowFar) {
  const auto map = mapOf(streetSession(80));
  PlaceFilter filter(*map, {});
  filter.reset({{20.0, 0.0}});
  filter.predict(Motion(1.0, OdometryIncrement{{6.0, 0.0}, 0.0, 6.0}));
  EXPECT_GT(filter.within({26.0, 0.0}, 1.5), 0.4);
  filter.reset({{20.0, 0.0}});
  filter.predict(afterSeconds(1.0));
  EXPECT_LT(filter.within({26.0, 0.0}, 1.5), 0.05);
}

// Many places beyond the end show its image: it is compared once.
TEST(PlaceFilter, TheMostProbableImagesAreDistinct) {
  const auto map = mapOf(streetSession(80));
  PlaceFilter filter(*map, {});
  filter.reset({{79.0, 0.0}});
  for (int i = 0; i < 10; ++i) filter.predict(afterSeconds(1.0));
  const std::vector<std::size_t> images = filter.mostProbableImages(10);
  EXPECT_EQ(images.size(), 10U);
  EXPECT_EQ(std::set<std::size_t>(images.begin(), images.end()).size(), 10U);
  EXPECT_EQ(images.front(), 79U);
}

TEST(PlaceFilter, FindsARobotThatWasCarriedAway) {
  const auto map = mapOf(streetSession(200));
  PlaceFilter filter(*map, {});
  double east_m = 10.0;
  for (int i = 0; i < 20; ++i, east_m += 1.0) {
    filter.predict(afterSeconds(1.0));
    filter.update(seenFrom(*map, east_m));
  }
  EXPECT_GT(filter.within({east_m - 1.0, 0.0}, 5.0), 0.97);
  east_m = 150.0;
  for (int i = 0; i < 10; ++i, east_m += 1.0) {
    filter.predict(afterSeconds(1.0));
    filter.update(seenFrom(*map, east_m));
  }
  EXPECT_GT(filter.within({east_m - 1.0, 0.0}, 5.0), 0.97);
}

TEST(PlaceFilter, FollowsARobotThatDrivesBackwards) {
  const auto map = mapOf(streetSession(200));
  BayesConfig config;
  PlaceFilter filter(*map, config);
  double east_m = 160.0;
  for (int i = 0; i < 60; ++i, east_m -= 1.0) {
    filter.predict(afterSeconds(1.0));
    PlaceLikelihood likelihood;
    for (std::size_t k = 0; k < map->size(); ++k) {
      const double offset_m = map->position_m(k).x() - east_m;
      Score score;
      score.matches = static_cast<int>(6.0 + 12.0 * std::exp(-0.5 * offset_m * offset_m));
      likelihood.compared.push_back(filter.comparedWith(k, score));
    }
    filter.update(likelihood);
    if (i < 15) continue;
    EXPECT_GT(filter.within({east_m, 0.0}, 3.0), 0.9) << i;
  }
}

TEST(PlaceFilter, ALargeMapCostsWhatIsProbable) {
  const auto map = mapOf(streetSession(50000));
  PlaceFilter filter(*map, {});
  const auto compared = [&](double east_m, std::size_t first, std::size_t count, std::size_t stride) {
    PlaceLikelihood likelihood;
    likelihood.asked_in_turn = count;
    for (std::size_t i = 0; i < count; ++i) {
      const double offset_m = map->position_m(first + i * stride).x() - east_m;
      likelihood.compared.push_back({first + i * stride, 1.0 + 100.0 * std::exp(-0.5 * offset_m * offset_m)});
    }
    return likelihood;
  };
  for (std::size_t i = 0; i < 100; ++i) {  // lost: others are compared each time
    filter.predict(afterSeconds(1.0));
    filter.update(compared(-100.0, i % 125, 400, 125));
    EXPECT_NEAR(sumOf(filter), 1.0, 1e-9);
    EXPECT_LE(filter.probabilities().allOwn().size(), PlaceProbabilities::kMostOwn);
  }
  double east_m = 30000.0;
  for (int i = 0; i < 100; ++i, east_m += 1.0) {
    filter.predict(afterSeconds(1.0));
    filter.update(compared(east_m, static_cast<std::size_t>(east_m) - 20, 40, 1));
    EXPECT_NEAR(sumOf(filter), 1.0, 1e-9);
  }
  EXPECT_GT(filter.within({east_m - 1.0, 0.0}, 5.0), 0.97);
  EXPECT_NEAR(filter.mode().mean_m.x(), east_m - 1.0, 0.5);
  EXPECT_LT(filter.probabilities().allOwn().size(), 1000U);
  // As for each training image alone.
  Eigen::Matrix2d expected_m2 = Eigen::Matrix2d::Zero();
  const Eigen::Vector2d centre_m = filter.mode().mean_m;
  for (std::size_t i = 0; i < filter.places().size(); ++i) {
    const Eigen::Vector2d offset_m = filter.places().position_m(i) - centre_m;
    expected_m2 += filter.probabilities()[i] * offset_m * offset_m.transpose();
  }
  EXPECT_NEAR(filter.covarianceAbout(centre_m)(0, 0), expected_m2(0, 0), 1e-6 * expected_m2(0, 0));
}

TEST(PlaceFilter, ManyImagesOfARobotThatStandsAreNotManyChancesToBeCarriedAway) {
  const auto map = mapOf(streetSession(200));
  BayesConfig config;
  PlaceFilter filter(*map, config);
  const auto look = [&](double east_m) {  // in bad light
    PlaceLikelihood likelihood;
    for (std::size_t i = 0; i < map->size(); ++i) {
      const double offset_m = map->position_m(i).x() - east_m;
      Score score;
      score.matches = static_cast<int>(6.0 + 12.0 * std::exp(-0.5 * offset_m * offset_m));
      likelihood.compared.push_back(filter.comparedWith(i, score));
    }
    filter.update(likelihood);
  };
  double east_m = 10.0;
  for (int i = 0; i < 20; ++i, east_m += 1.0) {
    filter.predict(afterSeconds(1.0));
    look(east_m);
  }
  for (int i = 0; i < 300; ++i) {
    filter.predict(afterSeconds(0.1));
    look(east_m);
    EXPECT_GT(filter.within({east_m, 0.0}, 5.0), 0.97) << i;
  }
  for (int i = 0; i < 100; ++i) {  // and then it is carried away
    filter.predict(afterSeconds(0.1));
    look(150.0);
  }
  EXPECT_GT(filter.within({150.0, 0.0}, 5.0), 0.97);
}

TEST(PlaceFilter, GoesFromOneSessionToAnother) {
  // The first session ends where the second goes on.
  std::vector<TrainingImage> images = streetSession(50);
  std::vector<TrainingImage> second = streetSession(100, 1);
  images.insert(images.end(), second.begin() + 45, second.end());
  const auto map = mapOf(images, 2);
  PlaceFilter filter(*map, {});
  filter.reset({{40.0, 0.0}});
  for (int i = 0; i < 20; ++i) filter.predict(afterSeconds(1.0));
  EXPECT_GT(filter.within({60.0, 0.0}, 10.0), 0.3);
}

TEST(PlaceFilter, DoesNotTurnAround) {
  std::vector<TrainingImage> images = streetSession(50);
  std::vector<TrainingImage> back = streetSession(50, 1);
  for (TrainingImage& image : back) image.yaw_rad = 3.14159;
  images.insert(images.end(), back.begin(), back.end());
  const auto map = mapOf(images, 2);
  PlaceFilter filter(*map, {});
  filter.reset({{20.0, 0.0}});
  filter.predict(afterSeconds(1.0));
  double back_sum = 0.0;
  for (std::size_t i = 50; i < map->size(); ++i) back_sum += filter.probabilities()[i];
  EXPECT_NEAR(back_sum, 0.02 * 50.0 / static_cast<double>(filter.places().size()), 1e-9);  // of anywhere
}

TEST(PlaceFilter, TheOrderOfTheSessionsDoesNotMatter) {
  const auto drive = [](bool swapped) {
    std::vector<TrainingImage> images = streetSession(40, swapped ? 1 : 0);
    std::vector<TrainingImage> others = streetSession(40, swapped ? 0 : 1);
    for (TrainingImage& image : images) image.position_m.y() = 0.0;
    for (TrainingImage& image : others) image.position_m.y() = 0.5;
    if (swapped) std::swap(images, others);
    images.insert(images.end(), others.begin(), others.end());
    const auto map = mapOf(images, 2);
    PlaceFilter filter(*map, {});
    for (int i = 0; i < 10; ++i) {
      filter.predict(afterSeconds(1.0));
      filter.update(seenFrom(*map, 10.0 + i));
    }
    return filter.mode();
  };
  // Of two that are equally far, at the end of what the robot may reach, the first in the map is looked at.
  EXPECT_NEAR((drive(false).mean_m - drive(true).mean_m).norm(), 0.0, 1e-3);
  EXPECT_NEAR((drive(false).covariance_m2 - drive(true).covariance_m2).norm(), 0.0, 1e-3);
}

TEST(PlaceFilter, WhatMatchesNothingLeavesItUnsure) {
  const auto map = mapOf(streetSession(200));
  PlaceFilter filter(*map, {});
  for (int i = 0; i < 50; ++i) {
    filter.predict(afterSeconds(1.0));
    filter.update(seenFrom(*map, 0.0, 0.0));
  }
  EXPECT_LT(filter.within(filter.mode().mean_m, 5.0), 0.5);
}

TEST(PlaceFilter, WhatWasNotComparedIsAsLikelyAsIsSaid) {
  const auto map = mapOf(streetSession(10));
  PlaceFilter filter(*map, {});
  PlaceLikelihood likelihood;
  likelihood.compared = {{3, 1.0}};
  likelihood.elsewhere = 4.0;
  filter.update(likelihood);
  EXPECT_LT(filter.probabilities()[3], filter.probabilities()[4]);
  EXPECT_DOUBLE_EQ(filter.probabilities()[4], filter.probabilities()[9]);
}

TEST(PlaceFilter, TheLikelihoodGrowsWithTheMatches) {
  const auto map = mapOf(streetSession(10));
  BayesConfig config;
  const PlaceFilter filter(*map, config);
  Score none;
  Score some;
  some.matches = 9;
  some.weight = some.similarity = 0.1;
  EXPECT_DOUBLE_EQ(filter.likelihoodOf(none), 1.0);
  EXPECT_DOUBLE_EQ(filter.likelihoodOf(some), 1000.0) << "SIFT: to the third";
  some.matches = 0;  // by global features
  EXPECT_DOUBLE_EQ(filter.likelihoodOf(some), 0.1);
}

TEST(PlaceFilter, ImagesThatFollowCloselySayLess) {
  const auto map = mapOf(streetSession(80));
  PlaceFilter filter(*map, {});
  Score score;
  score.matches = 9;
  filter.predict(afterSeconds(1.0));
  const double usual = filter.likelihoodOf(score);
  filter.predict(afterSeconds(0.1));
  EXPECT_LT(filter.likelihoodOf(score), 0.1 * usual);
  EXPECT_GT(filter.likelihoodOf(score), 1.0);
}

}  // namespace
}  // namespace visual_localization

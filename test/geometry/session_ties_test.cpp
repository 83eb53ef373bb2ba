// Sessions that saw the same are tied to each other.

#include <algorithm>
#include <cmath>
#include <iterator>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "test/geometry/recorded_street.h"
#include "test/support/stamps.h"

namespace visual_localization {
namespace {

using test::DrivenPose;
using test::imagesIn;
using test::kDensity;
using test::kFixNoise_m;
using test::pathError_m;
using test::recorded;
using test::RecordedDrive;
using test::WorldPoint;

/// Another drive along the same street, a little beside, whose fixes are all off by `bias_m`.
RecordedDrive again(const std::vector<WorldPoint>& world, const Eigen::Vector2d& bias_m, std::uint32_t seed) {
  std::mt19937 random(seed);
  auto poses = test::drive({});
  for (DrivenPose& pose : poses) pose.camera.position_m += pose.camera.rotation * Eigen::Vector3d(0.3, 0.0, 0.2);
  RecordedDrive drive = test::record(poses, world, kFixNoise_m, random);
  for (MapFix& fix : drive.fixes) fix.position_m += bias_m;
  return drive;
}

/// Receivers err anew on another day.
UnadjustedSession onDay(int day, const RecordedDrive& drive) {
  UnadjustedSession session = drive.unadjusted();
  const std::int64_t later_ns = day * 86'400 * test::kSecond_ns;
  for (TrajectoryPoint& image : session.images) image.stamp_ns += later_ns;
  for (MapFix& fix : session.fixes) fix.stamp_ns += later_ns;
  return session;
}

/// How far two sessions have what both see apart: the mean over landmarks that both name.
double apart_m(const std::vector<RecordedDrive>& drives, const std::vector<SessionGeometry>& sessions) {
  double sum_m = 0.0;
  for (std::size_t i = 0; i < drives[0].truth.size(); ++i) {
    const Eigen::Vector3d first = sessions[0].images[i]->camera.position_m - drives[0].truth[i].camera.position_m;
    const Eigen::Vector3d second = sessions[1].images[i]->camera.position_m - drives[1].truth[i].camera.position_m;
    sum_m += (first - second).head<2>().norm();
  }
  return sum_m / static_cast<double>(drives[0].truth.size());
}

TEST(SessionGeometry, TiesSessionsWhereTheyOverlap) {
  std::mt19937 random(21);
  const auto world = test::pointsAlong(test::drive({}), kDensity, random);
  const std::vector<RecordedDrive> drives{again(world, {0.0, 0.0}, 22), again(world, {1.5, -1.0}, 23)};
  const std::vector<UnadjustedSession> sessions{drives[0].unadjusted(), drives[1].unadjusted()};
  const auto alone_a = adjustSessions({sessions[0]}, {}, 1);
  const auto alone_b = adjustSessions({sessions[1]}, {}, 1);
  EXPECT_GT(apart_m(drives, {alone_a.front(), alone_b.front()}), 1.5);
  const auto tied = adjustSessions(sessions, {}, 2);
  ASSERT_EQ(tied.size(), 2U);
  EXPECT_LT(apart_m(drives, tied), 0.05);
  EXPECT_DOUBLE_EQ(tied[0].tied_apart_m, 0.0);
  EXPECT_NEAR(tied[1].tied_apart_m, std::hypot(1.5, 1.0), 0.3);
  for (const SessionGeometry& session : tied) EXPECT_EQ(imagesIn(session), session.images.size());
}

TEST(SessionGeometry, TwoTiedSessionsKnowWhereTheyAreBetterThanOne) {
  std::mt19937 random(21);
  const auto world = test::pointsAlong(test::drive({}), kDensity, random);
  const std::vector<RecordedDrive> drives{again(world, {0.1, 0.0}, 22), again(world, {-0.1, 0.0}, 23)};
  const auto alone = adjustSessions({drives[0].unadjusted()}, {}, 1);
  const auto tied = adjustSessions({onDay(0, drives[0]), onDay(1, drives[1])}, {}, 1);
  for (const SessionGeometry& session : tied) {
    for (std::size_t i = 0; i < session.images.size(); ++i) {
      const auto& covariance = session.images[i]->covariance;
      const double of_one = alone.front().images[i]->covariance(0, 0);
      EXPECT_LT(covariance(0, 0), 0.55 * of_one) << "the mean of two";
      EXPECT_GT(covariance(0, 0), 0.5 * 4.0 / 6.0 * 0.9 * of_one) << "that agree: the prior of four stays";
      EXPECT_EQ(covariance(5, 5), alone.front().images[i]->covariance(5, 5));
    }
  }
}

TEST(SessionGeometry, TwoTiedSessionsOfOneHourKnowNoMoreThanOne) {
  std::mt19937 random(21);
  const auto world = test::pointsAlong(test::drive({}), kDensity, random);
  const std::vector<RecordedDrive> drives{again(world, {0.1, 0.0}, 22), again(world, {-0.1, 0.0}, 23)};
  const auto first = adjustSessions({drives[0].unadjusted()}, {}, 1);
  const auto second = adjustSessions({drives[1].unadjusted()}, {}, 1);
  const auto tied = adjustSessions({drives[0].unadjusted(), drives[1].unadjusted()}, {}, 1);
  const double better = std::min(first.front().fixes.sigma_m, second.front().fixes.sigma_m);
  for (const SessionGeometry& session : tied) EXPECT_NEAR(session.fixes.sigma_m, better, 1e-9);
}

TEST(SessionGeometry, KnowsLessFarFromFixesUnlessAnotherSessionHasSome) {
  constexpr std::size_t kFirst = 18;  // ten images, a metre each
  constexpr std::size_t kLast = 27;
  std::mt19937 random(21);
  const auto world = test::pointsAlong(test::drive({}), kDensity, random);
  std::vector<RecordedDrive> drives{again(world, {0.0, 0.0}, 22), again(world, {0.0, 0.0}, 23)};
  const auto all = adjustSessions({onDay(0, drives[0]), onDay(1, drives[1])}, {}, 1);
  auto& fixes = drives[0].fixes;
  const auto at = [&](std::size_t image) {
    return fixes.begin() + static_cast<std::ptrdiff_t>(image * fixes.size() / drives[0].truth.size());
  };
  fixes.erase(at(kFirst), at(kLast + 1));
  const SessionGeometry alone = adjustSessions({drives[0].unadjusted()}, {}, 1).front();
  const auto variance = [](const SessionGeometry& session, std::size_t image) {
    return session.images[image]->covariance(0, 0);
  };
  const double near = variance(alone, 0);
  for (std::size_t i = 0; i < alone.images.size(); ++i) {
    const bool is_away = i >= kFirst && i <= kLast;
    const double away_m = is_away ? static_cast<double>(std::min(i - kFirst, kLast - i)) + 1.0 : 0.0;
    EXPECT_NEAR(std::sqrt(variance(alone, i) - near), 0.04 * away_m, 0.05) << i;
  }
  EXPECT_GT(variance(alone, (kFirst + kLast) / 2), near + 0.15 * 0.15);
  const auto tied = adjustSessions({onDay(0, drives[0]), onDay(1, drives[1])}, {}, 1);
  for (std::size_t i = 0; i < alone.images.size(); ++i) {
    EXPECT_LE(variance(tied[0], i), near) << i;
    // What fixes show about the path differs a little without ten seconds of them.
    EXPECT_GE(variance(tied[0], i), 0.8 * variance(all[0], i)) << i;
  }
}

TEST(SessionGeometry, SharesLandmarksOfTiedSessions) {
  std::mt19937 random(31);
  const auto world = test::pointsAlong(test::drive({}), kDensity, random);
  const std::vector<RecordedDrive> drives{again(world, {0.0, 0.0}, 32), again(world, {0.3, 0.2}, 33)};
  const auto tied = adjustSessions({drives[0].unadjusted(), drives[1].unadjusted()}, {}, 1);
  std::vector<std::set<std::uint32_t>> ids(2);
  for (std::size_t k = 0; k < 2; ++k) {
    for (const auto& image : tied[k].images) {
      for (const SeenLandmark& landmark : image->landmarks) ids[k].insert(landmark.id);
    }
  }
  std::vector<std::uint32_t> both;
  std::set_intersection(ids[0].begin(), ids[0].end(), ids[1].begin(), ids[1].end(), std::back_inserter(both));
  EXPECT_GT(2 * both.size(), ids[0].size());
}

TEST(SessionGeometry, LeavesSessionsApartThatShareNothing) {
  const RecordedDrive here = recorded({}, 41);
  RecordedDrive far = recorded({}, 42);
  for (MapFix& fix : far.fixes) fix.position_m += Eigen::Vector2d(1000.0, 0.0);
  const auto both = adjustSessions({here.unadjusted(), far.unadjusted()}, {}, 1);
  EXPECT_LT(pathError_m(both[0], here.truth), 0.15);
  std::set<std::uint32_t> ids;
  for (const auto& image : both[0].images) {
    for (const SeenLandmark& landmark : image->landmarks) ids.insert(landmark.id);
  }
  EXPECT_GT(imagesIn(both[1]), far.truth.size() / 2);
  for (const auto& image : both[1].images) {
    if (!image) continue;
    for (const SeenLandmark& landmark : image->landmarks) EXPECT_EQ(ids.count(landmark.id), 0U);
  }
}

}  // namespace
}  // namespace visual_localization

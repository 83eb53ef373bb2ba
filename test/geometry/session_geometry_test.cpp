#include "geometry/session_geometry.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "base/angles.h"
#include "test/support/landmark_world.h"

namespace visual_localization {
namespace {

using test::DrivenPose;
using test::RecordedDrive;
using test::WorldPoint;

constexpr double kFixNoise_m = 0.15;
constexpr double kDensity = 5.0;  ///< points for a metre of street

RecordedDrive recorded(const test::StreetDrive& street, std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto poses = test::drive(street);
  return test::record(poses, test::pointsAlong(poses, kDensity, random), kFixNoise_m, random);
}

SessionGeometry adjusted(const RecordedDrive& drive) { return adjustSessions({drive.unadjusted()}, {}, 1).front(); }

std::size_t imagesIn(const SessionGeometry& geometry) {
  return static_cast<std::size_t>(std::count_if(geometry.images.begin(), geometry.images.end(),
                                                [](const auto& image) { return image.has_value(); }));
}

/// Root mean square over the images that have a geometry.
double pathError_m(const SessionGeometry& geometry, const std::vector<DrivenPose>& truth) {
  std::vector<Eigen::Vector2d> positions_m;
  std::vector<DrivenPose> then;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (!geometry.images[i]) continue;
    positions_m.emplace_back(geometry.images[i]->camera.position_m.head<2>());
    then.push_back(truth[i]);
  }
  return test::pathError_m(positions_m, then);
}

double cleanedError_m(const RecordedDrive& drive) {
  std::vector<Eigen::Vector2d> positions_m;
  for (const TrajectoryPoint& image : drive.unadjusted().images) positions_m.push_back(image.position_m);
  return test::pathError_m(positions_m, drive.truth);
}

/// Cameras at one place for one image a second; each turned by `turn_rad` against the one before.
RecordedDrive standing(std::size_t images, double turn_rad) {
  std::mt19937 random(9);
  auto world = test::pointsAlong(test::drive({}), kDensity, random);
  std::vector<DrivenPose> poses(images);
  for (std::size_t i = 0; i < images; ++i) {
    poses[i].travel_yaw_rad = turn_rad * static_cast<double>(i);
    poses[i].camera.rotation = levelCamera(poses[i].travel_yaw_rad);
  }
  return test::record(poses, world, kFixNoise_m, random);
}

/// The same session with the true path instead of the cleaned one, which needs a robot that moves.
UnadjustedSession withTruePath(const RecordedDrive& drive) {
  UnadjustedSession session;
  session.camera = &drive.camera;
  session.fixes = drive.fixes;
  session.features = [&drive](std::size_t i) { return drive.views[i]; };
  for (std::size_t i = 0; i < drive.truth.size(); ++i) {
    session.images.push_back({static_cast<std::int64_t>(i) * 1'000'000'000, drive.truth[i].camera.position_m.head<2>(),
                              drive.truth[i].travel_yaw_rad});
  }
  return session;
}

void expectFinite(const SessionGeometry& geometry) {
  for (const auto& image : geometry.images) {
    if (!image) continue;
    EXPECT_TRUE(image->camera.position_m.allFinite());
    EXPECT_TRUE(image->camera.rotation.coeffs().allFinite());
    for (const SeenLandmark& landmark : image->landmarks) EXPECT_TRUE(landmark.offset_m.allFinite());
  }
}

// The median of five fixes to 0.15 m is good to 0.08 m in either axis. Shift and turn of the whole path average over 45
// of them: 0.03 m. The images' own errors along the path add as much.
constexpr double kPathError_m = 0.1;

TEST(SessionGeometry, PutsTheImagesWhereTheyWere) {
  const RecordedDrive drive = recorded({}, 1);
  const SessionGeometry geometry = adjusted(drive);
  EXPECT_EQ(imagesIn(geometry), drive.truth.size());
  EXPECT_LT(pathError_m(geometry, drive.truth), kPathError_m);
  EXPECT_LT(geometry.median_error_px, 0.5) << "the median of a Rayleigh distribution of 0.3 pixels is 0.35";
}

// A third of the fixes bend aside by up to 8 m.
TEST(SessionGeometry, BelievesTheImagesWhereFixesBend) {
  RecordedDrive drive = recorded({}, 2);
  test::bendFixes(drive, 0.33, 0.66, 8.0);
  const SessionGeometry geometry = adjusted(drive);
  EXPECT_EQ(imagesIn(geometry), drive.truth.size());
  const double error_m = pathError_m(geometry, drive.truth);
  EXPECT_LT(error_m, kPathError_m);
  EXPECT_LT(error_m, 0.25 * cleanedError_m(drive));
}

TEST(SessionGeometry, HoldsForACameraThatLooksUp) {
  test::StreetDrive street;
  street.pitch_rad = 5.0 * kPi / 180.0;
  const RecordedDrive drive = recorded(street, 15);
  const SessionGeometry geometry = adjusted(drive);
  EXPECT_EQ(imagesIn(geometry), drive.truth.size());
  EXPECT_LT(pathError_m(geometry, drive.truth), kPathError_m);
  EXPECT_NEAR(geometry.mounting_rad.x(), street.pitch_rad, 0.01);
}

// Heights and tilts are not: that roads are level is all that is known of them.
TEST(SessionGeometry, HoldsWhereTheStreetClimbs) {
  test::StreetDrive street;
  street.slope = 0.1;
  const RecordedDrive drive = recorded(street, 3);
  const SessionGeometry geometry = adjusted(drive);
  EXPECT_EQ(imagesIn(geometry), drive.truth.size());
  EXPECT_LT(pathError_m(geometry, drive.truth), kPathError_m);
}

TEST(SessionGeometry, HoldsForACameraThatLooksAside) {
  test::StreetDrive street;
  street.yaw_rad = 15.0 * kPi / 180.0;
  const RecordedDrive drive = recorded(street, 4);
  const SessionGeometry geometry = adjusted(drive);
  EXPECT_EQ(imagesIn(geometry), drive.truth.size());
  EXPECT_LT(pathError_m(geometry, drive.truth), kPathError_m);
  EXPECT_NEAR(geometry.mounting_rad.y(), street.yaw_rad, 0.02);
}

/// A car that drives ahead, and a poster that hangs in ten places.
std::vector<WorldPoint> disturbedWorld(const std::vector<DrivenPose>& poses, std::mt19937& random) {
  auto world = test::pointsAlong(poses, kDensity, random);
  for (std::size_t i = 0; i < world.size(); i += 10) world[i].motion_m = {0.4, 0.3, 0.0};
  for (std::size_t i = 5; i < world.size(); i += 20) world[i].descriptor = world[5 + 20 * (i % 3)].descriptor;
  return world;
}

TEST(SessionGeometry, IgnoresWhatMovesAndWhatLooksAlike) {
  std::mt19937 random(5);
  const auto poses = test::drive({});
  const RecordedDrive drive = test::record(poses, disturbedWorld(poses, random), kFixNoise_m, random);
  const SessionGeometry geometry = adjusted(drive);
  EXPECT_EQ(imagesIn(geometry), drive.truth.size());
  EXPECT_LT(pathError_m(geometry, drive.truth), kPathError_m);
}

TEST(SessionGeometry, CallsALandmarkTheSameInAllImages) {
  const RecordedDrive drive = recorded({}, 6);
  const SessionGeometry geometry = adjustSessions({drive.unadjusted()}, {}, 1).front();
  std::map<std::uint32_t, Eigen::Vector3d> positions_m;
  std::size_t sightings = 0;
  for (const auto& image : geometry.images) {
    ASSERT_TRUE(image);
    sightings += image->landmarks.size();
    for (const SeenLandmark& landmark : image->landmarks) {
      const Eigen::Vector3d position_m = image->camera.position_m + landmark.offset_m.cast<double>();
      const auto [known, is_new] = positions_m.emplace(landmark.id, position_m);
      EXPECT_LT((known->second - position_m).norm(), 1e-4) << landmark.id;
    }
  }
  EXPECT_EQ(sightings, geometry.sightings);
  ASSERT_EQ(positions_m.size(), geometry.landmarks);
  EXPECT_EQ(positions_m.begin()->first, 0U);
  EXPECT_EQ(positions_m.rbegin()->first, geometry.landmarks - 1);
}

TEST(SessionGeometry, NamesEachFeatureOnceAndInOrder) {
  const RecordedDrive drive = recorded({}, 7);
  const SessionGeometry geometry = adjusted(drive);
  for (std::size_t i = 0; i < geometry.images.size(); ++i) {
    const auto& landmarks = geometry.images[i]->landmarks;
    const auto wrong = std::adjacent_find(landmarks.begin(), landmarks.end(),
                                          [](const auto& a, const auto& b) { return a.feature >= b.feature; });
    EXPECT_TRUE(wrong == landmarks.end()) << i;
    EXPECT_LT(landmarks.back().feature, drive.views[i]->size()) << i;
  }
}

TEST(SessionGeometry, DoesNotDependOnTheNumberOfThreads) {
  const RecordedDrive drive = recorded({}, 8);
  const SessionGeometry one = adjustSessions({drive.unadjusted()}, {}, 1).front();
  const SessionGeometry two = adjustSessions({drive.unadjusted()}, {}, 2).front();
  EXPECT_EQ(one.landmarks, two.landmarks);
  EXPECT_EQ(one.sightings, two.sightings);
  for (std::size_t i = 0; i < one.images.size(); ++i) {
    EXPECT_EQ(one.images[i]->camera.position_m, two.images[i]->camera.position_m) << i;
    EXPECT_EQ(one.images[i]->camera.rotation.coeffs(), two.images[i]->camera.rotation.coeffs()) << i;
  }
}

TEST(SessionGeometry, OfARobotThatStandsIsNone) {
  const RecordedDrive drive = standing(20, 0.0);
  const SessionGeometry geometry = adjustSessions({withTruePath(drive)}, {}, 1).front();
  EXPECT_EQ(geometry.images.size(), 20U);
  EXPECT_EQ(imagesIn(geometry), 0U);
}

TEST(SessionGeometry, OfARobotThatTurnsOnTheSpotIsNone) {
  const RecordedDrive drive = standing(20, 0.05);
  const SessionGeometry geometry = adjustSessions({withTruePath(drive)}, {}, 1).front();
  EXPECT_EQ(geometry.images.size(), 20U);
  EXPECT_EQ(imagesIn(geometry), 0U);
}

TEST(SessionGeometry, WithoutTextureIsNone) {
  RecordedDrive drive = recorded({}, 10);
  for (auto& view : drive.views) view = std::make_shared<const SiftFeatures>();
  const SessionGeometry geometry = adjusted(drive);
  EXPECT_EQ(geometry.images.size(), drive.truth.size());
  EXPECT_EQ(imagesIn(geometry), 0U);
  EXPECT_EQ(geometry.landmarks, 0U);
}

// No pair of images bridges it, so the two parts hang on the fixes and the direction of travel alone: straight on,
// since in turns the cleaned path cuts corners and misses that direction by up to 0.15 rad.
TEST(SessionGeometry, HasAHoleWhereNothingIsToBeSeen) {
  test::StreetDrive street;
  street.turn_rad = 0.0;
  RecordedDrive drive = recorded(street, 11);
  for (std::size_t i = 20; i < 25; ++i) drive.views[i] = std::make_shared<const SiftFeatures>();
  const SessionGeometry geometry = adjusted(drive);
  EXPECT_EQ(imagesIn(geometry), drive.truth.size() - 5);
  for (std::size_t i = 20; i < 25; ++i) EXPECT_FALSE(geometry.images[i]) << i;
  EXPECT_LT(pathError_m(geometry, drive.truth), kPathError_m);
}

TEST(SessionGeometry, OfNoImagesIsNone) {
  const CameraModel camera = test::streetCamera();
  UnadjustedSession session;
  session.camera = &camera;
  const SessionGeometry geometry = adjustSessions({session}, {}, 1).front();
  EXPECT_TRUE(geometry.images.empty());
  EXPECT_EQ(geometry.landmarks, 0U);
}

TEST(SessionGeometry, BridgesImagesWithoutFixes) {
  RecordedDrive drive = recorded({}, 12);
  auto& fixes = drive.fixes;
  const auto third = static_cast<std::ptrdiff_t>(fixes.size() / 3);
  fixes.erase(fixes.begin() + third, fixes.begin() + 2 * third);
  EXPECT_LT(pathError_m(adjusted(drive), drive.truth), kPathError_m);
}

// Nothing says where the path is then: it only must not fall apart.
TEST(SessionGeometry, WithoutAnyFixIsFinite) {
  const RecordedDrive drive = recorded({}, 13);
  UnadjustedSession session = drive.unadjusted();
  session.fixes.clear();
  const SessionGeometry geometry = adjustSessions({session}, {}, 1).front();
  EXPECT_EQ(geometry.images.size(), drive.truth.size());
  expectFinite(geometry);
  EXPECT_LT(pathError_m(geometry, drive.truth), 5.0);
}

TEST(SessionGeometry, OfASingleImageIsNone) {
  test::StreetDrive street;
  street.images = 2;
  RecordedDrive drive = recorded(street, 14);
  UnadjustedSession session = withTruePath(drive);
  session.images.pop_back();
  const SessionGeometry geometry = adjustSessions({session}, {}, 1).front();
  ASSERT_EQ(geometry.images.size(), 1U);
  EXPECT_FALSE(geometry.images[0]);
}

/// Another drive along the same street, a little beside, whose fixes are all off by `bias_m`.
RecordedDrive again(const std::vector<WorldPoint>& world, const Eigen::Vector2d& bias_m, std::uint32_t seed) {
  std::mt19937 random(seed);
  auto poses = test::drive({});
  for (DrivenPose& pose : poses) pose.camera.position_m += pose.camera.rotation * Eigen::Vector3d(0.3, 0.0, 0.2);
  RecordedDrive drive = test::record(poses, world, kFixNoise_m, random);
  for (MapFix& fix : drive.fixes) fix.position_m += bias_m;
  return drive;
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

/// The fixes are those of an antenna `antenna_m` away from the camera, in the optical frame.
RecordedDrive withAntenna(RecordedDrive drive, const Eigen::Vector3d& antenna_m) {
  const double per_image = static_cast<double>(drive.fixes.size()) / static_cast<double>(drive.truth.size());
  for (std::size_t i = 0; i < drive.fixes.size(); ++i) {
    const auto image = static_cast<std::size_t>(static_cast<double>(i) / per_image);
    drive.fixes[i].position_m += (drive.truth[image].camera.rotation * antenna_m).head<2>();
  }
  return drive;
}

TEST(SessionGeometry, KnowsTheAntennaFromTheCamera) {
  const Eigen::Vector3d antenna_m(0.5, -0.6, -0.6);
  const RecordedDrive drive = withAntenna(recorded({}, 51), antenna_m);
  UnadjustedSession session = drive.unadjusted();
  EXPECT_GT(pathError_m(adjustSessions({session}, {}, 1).front(), drive.truth), 0.5) << "nobody said where it is";
  session.mount.antenna_m = session.mount.camera.position_m + session.mount.camera.rotation * antenna_m;
  EXPECT_LT(pathError_m(adjustSessions({session}, {}, 1).front(), drive.truth), 0.15);
}

}  // namespace
}  // namespace visual_localization

#include "geometry/session_geometry.h"

#include <algorithm>
#include <map>
#include <random>

#include <gtest/gtest.h>

#include "base/numbers.h"
#include "test/geometry/recorded_street.h"

namespace visual_localization {
namespace {

using test::adjusted;
using test::DrivenPose;
using test::imagesIn;
using test::kDensity;
using test::kFixNoise_m;
using test::kPathError_m;
using test::pathError_m;
using test::recorded;
using test::RecordedDrive;
using test::WorldPoint;

double cleanedError_m(const RecordedDrive& drive) {
  std::vector<Eigen::Vector2d> positions_m;
  for (const TrajectoryPoint& image : drive.unadjusted().images) positions_m.push_back(image.position_m);
  return test::pathError_m(positions_m, drive.truth);
}

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

// A receiver that is good to 3 cm, 150 ms late: 0.6 m at 4 m/s.
TEST(SessionGeometry, FindsHowLateTheFixesAre) {
  constexpr double kNoise_m = 0.03;
  std::mt19937 random(16);
  test::StreetDrive street;
  street.spacing_m = 4.0;
  const auto poses = test::drive(street);
  RecordedDrive drive = test::record(poses, test::pointsAlong(poses, 4.0 * kDensity, random), kNoise_m, random);
  for (MapFix& fix : drive.fixes) {
    fix.stamp_ns += 150'000'000;
    fix.sigma_m = kNoise_m;
  }
  const SessionGeometry geometry = adjusted(drive);
  EXPECT_NEAR(geometry.fix_delay_s, 0.15, 0.03);
  EXPECT_LT(pathError_m(geometry, drive.truth), 0.15);
}

// Half a second of a slow robot is less than its fixes' noise, and two and a half sigmas; a hundredth of a second
// is none however exact the receiver.
TEST(SessionGeometry, FindsASmallDelayOfASlowRobotAndNoneOfExactStamps) {
  const auto found_s = [](double spacing_m, double noise_m, std::int64_t late_ns) {
    std::mt19937 random(17);
    test::StreetDrive street;
    street.spacing_m = spacing_m;
    const auto poses = test::drive(street);
    RecordedDrive drive = test::record(poses, test::pointsAlong(poses, 4.0 / spacing_m, random), noise_m, random);
    for (MapFix& fix : drive.fixes) {
      fix.stamp_ns += late_ns;
      fix.sigma_m = noise_m;
    }
    UnadjustedSession session = drive.unadjusted();
    session.clock_sigma_s = 0.5;
    return adjustSessions({session}, {}, 1).front().fix_delay_s;
  };
  EXPECT_NEAR(found_s(0.7, 0.1, 500'000'000), 0.5, 0.2);
  EXPECT_DOUBLE_EQ(found_s(4.0, 0.02, 10'000'000), 0.0);
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

/// A street that climbs by 10 % in its middle third.
RecordedDrive climbing(std::size_t images) {
  test::StreetDrive street;
  street.images = images;
  street.slope = 0.1;
  return recorded(street, 3);
}

/// Root mean square of the heights, and of the tilts along the view, that the adjustment came to.
std::pair<double, double> heightAndTiltErrors(const SessionGeometry& geometry, const std::vector<DrivenPose>& truth) {
  double heights_m2 = 0.0;
  double tilts_rad2 = 0.0;
  const double start_m = truth.front().camera.position_m.z();
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const CameraPose& camera = geometry.images[i]->camera;
    const double height_m = camera.position_m.z() - (truth[i].camera.position_m.z() - start_m);
    const double tilt_rad = std::asin(camera.ahead().z()) - std::asin(truth[i].camera.ahead().z());
    heights_m2 += height_m * height_m / static_cast<double>(truth.size());
    tilts_rad2 += tilt_rad * tilt_rad / static_cast<double>(truth.size());
  }
  return {std::sqrt(heights_m2), std::sqrt(tilts_rad2)};
}

// Heights and tilts are not: without altitudes all that is known of roads is that they are level.
TEST(SessionGeometry, HoldsWhereTheStreetClimbs) {
  const RecordedDrive drive = climbing(45);
  const SessionGeometry geometry = adjusted(drive);
  EXPECT_EQ(imagesIn(geometry), drive.truth.size());
  EXPECT_LT(pathError_m(geometry, drive.truth), kPathError_m);
}

TEST(SessionGeometry, KnowsByAltitudesHowTheStreetClimbs) {
  RecordedDrive drive = climbing(150);
  std::mt19937 random(8);
  std::normal_distribution<double> noise_m(0.0, 0.3);
  for (MapFix& fix : drive.fixes) {
    const auto image =
        std::min<std::size_t>(static_cast<std::size_t>(fix.stamp_ns / 1'000'000'000), drive.truth.size() - 1);
    fix.up_m = 40.0 + drive.truth[image].camera.position_m.z() + noise_m(random);
    fix.sigma_up_m = 0.3;
  }
  const SessionGeometry geometry = adjusted(drive);
  EXPECT_EQ(imagesIn(geometry), drive.truth.size());
  EXPECT_LT(pathError_m(geometry, drive.truth), kPathError_m);
  const auto [height_m, tilt_rad] = heightAndTiltErrors(geometry, drive.truth);
  EXPECT_LT(height_m, 0.25);  // without altitudes 1.1 m and 0.044 rad
  EXPECT_LT(tilt_rad, 0.01);
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
  std::size_t observations = 0;
  for (const auto& image : geometry.images) {
    ASSERT_TRUE(image);
    observations += image->landmarks.size();
    for (const SeenLandmark& landmark : image->landmarks) {
      const Eigen::Vector3d position_m = image->camera.position_m + landmark.offset_m.cast<double>();
      const auto [known, is_new] = positions_m.emplace(landmark.id, position_m);
      EXPECT_LT((known->second - position_m).norm(), 1e-4) << landmark.id;
    }
  }
  EXPECT_EQ(observations, geometry.observations);
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
  EXPECT_EQ(one.observations, two.observations);
  for (std::size_t i = 0; i < one.images.size(); ++i) {
    EXPECT_EQ(one.images[i]->camera.position_m, two.images[i]->camera.position_m) << i;
    EXPECT_EQ(one.images[i]->camera.rotation.coeffs(), two.images[i]->camera.rotation.coeffs()) << i;
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

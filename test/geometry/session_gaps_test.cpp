// What a session may lack: motion, texture, images or fixes.

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include <gtest/gtest.h>

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
  for (auto& view : drive.views) view = std::make_shared<const LocalFeatures>();
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
  for (std::size_t i = 20; i < 25; ++i) drive.views[i] = std::make_shared<const LocalFeatures>();
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

TEST(SessionGeometry, BridgesImagesWithoutFixes) {
  RecordedDrive drive = recorded({}, 12);
  auto& fixes = drive.fixes;
  const auto third = static_cast<std::ptrdiff_t>(fixes.size() / 3);
  fixes.erase(fixes.begin() + third, fixes.begin() + 2 * third);
  EXPECT_LT(pathError_m(adjusted(drive), drive.truth), kPathError_m);
}

/// How far aside a bump lies: 0 at the images `begin` and `end` of a session and beyond, `most_m` midway.
struct Bump {
  std::int64_t begin_ns;
  std::int64_t end_ns;
  double most_m;

  Bump(const UnadjustedSession& session, std::size_t begin, std::size_t end, double most)
      : begin_ns(session.images[begin].stamp_ns), end_ns(session.images[end].stamp_ns), most_m(most) {}

  bool holds(std::int64_t stamp_ns) const { return stamp_ns >= begin_ns && stamp_ns <= end_ns; }

  double aside_m(std::int64_t stamp_ns) const {
    if (!holds(stamp_ns)) return 0.0;
    const double share = static_cast<double>(stamp_ns - begin_ns) / static_cast<double>(end_ns - begin_ns);
    return most_m * std::pow(std::sin(M_PI * share), 2);
  }

  void applyTo(std::vector<TrajectoryPoint>& images) const {
    for (TrajectoryPoint& image : images) image.position_m.y() += aside_m(image.stamp_ns);
  }
};

RecordedDrive longDrive() {
  test::StreetDrive street;
  street.images = 90;
  return recorded(street, 15);
}

// A cleaned path crosses a gap in a straight line, however the road bends. The images know better, and that is no sign
// of a wrong calibration.
TEST(SessionGeometry, IsBelievedWhereTheCleanedPathGuessed) {
  RecordedDrive drive = longDrive();
  UnadjustedSession session = withTruePath(drive);
  const Bump bump(session, 25, 65, 5.0);
  bump.applyTo(session.images);
  const auto is_in_gap = [&](const MapFix& fix) { return bump.holds(fix.stamp_ns); };
  session.fixes.erase(std::remove_if(session.fixes.begin(), session.fixes.end(), is_in_gap), session.fixes.end());
  const SessionGeometry geometry = adjustSessions({session}, {}, 1).front();
  EXPECT_GT(geometry.largest_shift_m, 0.8 * bump.most_m);
  EXPECT_FALSE(geometry.contradicts_calibration);
  EXPECT_FALSE(geometry.contradicts_fixes);
  EXPECT_EQ(imagesIn(geometry), drive.truth.size());
}

// North and south exchanged: where the fixes turn right, the images turn left.
TEST(SessionGeometry, ContradictsMirroredFixes) {
  RecordedDrive drive = longDrive();
  UnadjustedSession session = withTruePath(drive);
  for (MapFix& fix : session.fixes) fix.position_m.y() *= -1.0;
  for (TrajectoryPoint& image : session.images) {
    image.position_m.y() *= -1.0;
    image.yaw_rad *= -1.0;
  }
  const SessionGeometry geometry = adjustSessions({session}, {}, 1).front();
  EXPECT_TRUE(geometry.contradicts_fixes || geometry.contradicts_calibration)
      << geometry.located << " located, " << geometry.off_fixes << " off, " << geometry.unexplained << " unexplained, "
      << geometry.agreeing_share << " agree";
}

void expectFinite(const SessionGeometry& geometry) {
  for (const auto& image : geometry.images) {
    if (!image) continue;
    EXPECT_TRUE(image->camera.position_m.allFinite());
    EXPECT_TRUE(image->camera.rotation.coeffs().allFinite());
    for (const SeenLandmark& landmark : image->landmarks) EXPECT_TRUE(landmark.offset_m.allFinite());
  }
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

}  // namespace
}  // namespace visual_localization

#include "visual_localization/geo/trajectory.h"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

#include "base/numbers.h"

namespace visual_localization {
namespace {

constexpr std::int64_t kSecond = 1000000000;
const double kNan = std::nan("");

TrajectoryPoint point(std::int64_t stamp_ns, double x, double y, double yaw = 0.0) { return {stamp_ns, {x, y}, yaw}; }

TEST(LocalFrame, OneDegreeIsWhatTheEllipsoidSays) {
  // At the equator a minute of longitude is a * pi / 10800 = 1855.3248 m; over 0.001 degrees the plane is flat.
  const LocalFrame equator({0.0, 10.0, 0.0});
  const Eigen::Vector2d east = equator.toEastNorth({0.0, 10.001, 0.0});
  EXPECT_NEAR(east.x(), 6378137.0 * 0.001 * kPi / 180.0, 1e-3);
  EXPECT_NEAR(east.y(), 0.0, 1e-9);
  // Meridian radius of curvature at the equator: a (1 - e^2).
  const Eigen::Vector2d north = equator.toEastNorth({0.001, 10.0, 0.0});
  EXPECT_NEAR(north.y(), 6378137.0 * (1.0 - 0.00669437999014) * 0.001 * kPi / 180.0, 1e-3);
}

TEST(LocalFrame, WayBackIsExact) {
  const LocalFrame frame({48.5345, 9.0713, 445.0});
  for (const Eigen::Vector2d& position :
       {Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(-1234.5, 987.6), Eigen::Vector2d(20000.0, -15000.0)}) {
    const GeodeticPoint geodetic = frame.toGeodetic(position);
    EXPECT_LT((frame.toEastNorth(geodetic) - position).norm(), 1e-3);
    EXPECT_EQ(geodetic.altitude_m, 445.0);
  }
}

TEST(LocalFrame, AltitudeOfAFixDoesNotMoveIt) {
  const LocalFrame frame({48.5345, 9.0713, 445.0});
  EXPECT_EQ(frame.toEastNorth({48.54, 9.08, 445.0}), frame.toEastNorth({48.54, 9.08, kNan}));
}

TEST(LocalFrame, WorksAcrossTheDateLine) {
  const LocalFrame fiji({-17.0, 179.9999, 0.0});
  EXPECT_NEAR(fiji.toEastNorth({-17.0, -179.9999, 0.0}).x(), 21.3, 0.1);
}

TEST(LocalFrame, RefusesADatumThatIsNoPlace) {
  for (const GeodeticPoint& datum :
       {GeodeticPoint{kNan, 0.0, 0.0}, GeodeticPoint{91.0, 0.0, 0.0}, GeodeticPoint{0.0, 181.0, 0.0},
        GeodeticPoint{0.0, 0.0, std::numeric_limits<double>::infinity()}}) {
    EXPECT_THROW(LocalFrame{datum}, std::invalid_argument);
  }
}

TEST(LocalFrame, TheBordersOfTheEarthArePlaces) {
  for (const GeodeticPoint& border : {GeodeticPoint{90.0, 180.0, 0.0}, GeodeticPoint{-90.0, -180.0, 0.0}}) {
    EXPECT_TRUE(isValid(border));
  }
  for (const GeodeticPoint& beyond :
       {GeodeticPoint{90.001, 0.0, 0.0}, GeodeticPoint{-90.001, 0.0, 0.0}, GeodeticPoint{0.0, 180.001, 0.0},
        GeodeticPoint{0.0, -180.001, 0.0}, GeodeticPoint{kNan, 0.0, 0.0}, GeodeticPoint{0.0, kNan, 0.0}}) {
    EXPECT_FALSE(isValid(beyond));
  }
}

TEST(Fix, HasAPositionUnlessItIsTheOriginOfAReceiverThatKnowsNone) {
  Fix fix;
  fix.has_fix = true;
  EXPECT_FALSE(hasPosition(fix));
  fix.position = {0.0, 0.5, 0.0};
  EXPECT_TRUE(hasPosition(fix)) << "on the equator";
  fix.position = {0.5, 0.0, 0.0};
  EXPECT_TRUE(hasPosition(fix)) << "in Greenwich's longitude";
  fix.position = {95.0, 0.5, 0.0};
  EXPECT_FALSE(hasPosition(fix));
  fix.position = {0.5, 0.5, 0.0};
  fix.has_fix = false;
  EXPECT_FALSE(hasPosition(fix));
}

TEST(Trajectory, InterpolatesPositionAndHeading) {
  const Trajectory trajectory({point(0, 0.0, 0.0, 0.0), point(2 * kSecond, 4.0, 2.0, 1.0)});
  const auto middle = trajectory.at(kSecond / 2);
  ASSERT_TRUE(middle);
  EXPECT_EQ(middle->stamp_ns, kSecond / 2);
  EXPECT_DOUBLE_EQ(middle->position_m.x(), 1.0);
  EXPECT_DOUBLE_EQ(middle->position_m.y(), 0.5);
  EXPECT_DOUBLE_EQ(middle->yaw_rad, 0.25);
}

TEST(Trajectory, HeadingTurnsTheShorterWay) {
  const Trajectory trajectory({point(0, 0, 0, 3.0), point(kSecond, 1, 0, -3.0)});
  const double yaw = trajectory.at(kSecond / 2)->yaw_rad;
  EXPECT_NEAR(std::abs(yaw), kPi, 1e-9);
}

TEST(Trajectory, HeadingStaysWithinHalfATurn) {
  const Trajectory left({point(0, 0, 0, 3.0), point(kSecond, 1, 0, -3.0)});
  EXPECT_NEAR(left.at(kSecond / 4 * 3)->yaw_rad, -3.0 - 0.25 * (2.0 * kPi - 6.0), 1e-9);
  const Trajectory right({point(0, 0, 0, -3.0), point(kSecond, 1, 0, 3.0)});
  EXPECT_NEAR(right.at(kSecond / 4 * 3)->yaw_rad, 3.0 + 0.25 * (2.0 * kPi - 6.0), 1e-9);
}

TEST(Trajectory, KnowsNothingOutsideOrInAGap) {
  const Trajectory trajectory({point(0, 0, 0), point(kSecond, 1, 0), point(20 * kSecond, 2, 0)}, 10.0);
  EXPECT_FALSE(trajectory.at(-1));
  EXPECT_TRUE(trajectory.at(0));
  EXPECT_TRUE(trajectory.at(kSecond / 3));
  EXPECT_FALSE(trajectory.at(5 * kSecond));
  EXPECT_TRUE(trajectory.at(20 * kSecond));
  EXPECT_FALSE(trajectory.at(20 * kSecond + 1));
  EXPECT_FALSE(Trajectory().at(0));
}

TEST(Trajectory, LengthSumsTheSteps) {
  EXPECT_DOUBLE_EQ(Trajectory({point(0, 0, 0), point(1, 3, 4), point(2, 3, 5)}).length(), 6.0);
  EXPECT_EQ(Trajectory().length(), 0.0);
}

TEST(Trajectory, RefusesDisorderAndNonsense) {
  EXPECT_THROW(Trajectory({point(1, 0, 0), point(1, 1, 0)}), std::invalid_argument);
  EXPECT_THROW(Trajectory({point(2, 0, 0), point(1, 1, 0)}), std::invalid_argument);
  EXPECT_THROW(Trajectory({point(1, kNan, 0)}), std::invalid_argument);
  EXPECT_THROW(Trajectory({point(1, 0, 0, kNan)}), std::invalid_argument);
}

}  // namespace
}  // namespace visual_localization

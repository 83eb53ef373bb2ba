#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "evaluation/score_table.h"
#include "test/support/refusal.h"
#include "test/support/temporary_folder.h"

namespace visual_localization {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const char* const kHeader = "stamp_ns,east_m,north_m,up_m,yaw_rad,pitch_rad\n";

class Poses : public ::testing::Test {
 protected:
  Trajectory read(const std::string& text) const {
    writeFile(path_, text);
    return readPoses(path_);
  }
  std::string refusal(const std::string& text) const {
    return test::refusalOf<FileError>([&] { read(text); });
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_ / "drive.pose.csv";
};

TEST_F(Poses, AreReadByTheNamesOfTheirColumns) {
  const Trajectory poses = read("yaw_rad,stamp_ns,north_m,east_m,weather\r\n0.5,1000000000,2,1,rain\r\n");
  ASSERT_EQ(poses.points().size(), 1U);
  const TrajectoryPoint& pose = poses.points().front();
  EXPECT_EQ(pose.stamp_ns, 1'000'000'000);
  EXPECT_EQ(pose.position_m, Eigen::Vector2d(1.0, 2.0));
  EXPECT_EQ(pose.yaw_rad, 0.5);
}

TEST_F(Poses, AreKnownBetweenTwoThatAreClose) {
  const Trajectory poses =
      read(std::string(kHeader) + "0,0,0,1,3.1,0\n1000000000,2,0,1,-3.1,0\n9000000000,4,0,1,0,0\n");
  const auto between = poses.at(500'000'000);
  ASSERT_TRUE(between);
  EXPECT_EQ(between->position_m.x(), 1.0);
  EXPECT_NEAR(std::abs(between->yaw_rad), 3.14159, 1e-4);
  EXPECT_FALSE(poses.at(5'000'000'000));
}

TEST_F(Poses, RefuseWhatCannotBe) {
  const std::string header = kHeader;
  EXPECT_THAT(refusal(header + "0,0,0,1,0,0\n1,nan,0,1,0,0\n"),
              AllOf(StartsWith(path_ + ": line 3: "), HasSubstr("east_m = 'nan' is not a finite number")));
  EXPECT_THAT(refusal(header + "1,0,0,1,inf,0\n"), HasSubstr("yaw_rad = 'inf'"));
  EXPECT_THAT(refusal(header + "1,0,1e999,1,0,0\n"), HasSubstr("north_m = '1e999'"));
  EXPECT_THAT(refusal(header + "1.5,0,0,1,0,0\n"), HasSubstr("stamp_ns = '1.5'"));
  EXPECT_THAT(refusal(header + "1,0,,1,0,0\n"), HasSubstr("north_m = ''"));
  EXPECT_THAT(refusal(header + "1,0,0,1,0\n"), HasSubstr("line 2: has 5 fields, the header 6"));
  EXPECT_THAT(refusal(header + "2,0,0,1,0,0\n2,0,0,1,0,0\n"), HasSubstr("line 3: stamp_ns is not later"));
  EXPECT_THAT(refusal("stamp_ns,east_m,north_m\n1,0,0\n"), HasSubstr("has no column yaw_rad"));
  EXPECT_THAT(refusal(header), HasSubstr("holds no pose"));
  EXPECT_THAT(refusal(""), HasSubstr("is empty"));
  EXPECT_THROW(readPoses(folder_ / "absent.csv"), FileError);
}

TEST(MovedOnto, TiesAnOriginToAnother) {
  const Trajectory poses({{0, {0.0, 0.0}, 1.0}, {1, {1.0, 0.0}, 1.0}, {2, {2.0, 0.0}, 1.0}});
  const Trajectory positions({{0, {10.0, 5.0}, 0.0}, {1, {11.0, 5.0}, 0.0}, {2, {12.0, 9.0}, 0.0}});  // the last is off
  const Trajectory moved = movedOnto(positions, poses);
  EXPECT_EQ(moved.points()[2].position_m, Eigen::Vector2d(12.0, 5.0));
  EXPECT_EQ(moved.points()[2].yaw_rad, 1.0);
}

TEST(MovedOnto, NeedsACommonTime) {
  const Trajectory poses({{5, {0.0, 0.0}, 0.0}});
  EXPECT_THROW(movedOnto(Trajectory({{0, {0.0, 0.0}, 0.0}, {4, {1.0, 0.0}, 0.0}}), poses), std::runtime_error);
}

}  // namespace
}  // namespace visual_localization

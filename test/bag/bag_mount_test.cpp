#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/NavSatFix.h>
#include <tf2_msgs/TFMessage.h>

#include "test/support/refusal.h"
#include "test/support/temporary_folder.h"
#include "visual_localization/bag/bag_reader.h"

namespace visual_localization {
namespace {

geometry_msgs::TransformStamped transform(const std::string& parent, const std::string& child, double x, double y,
                                          double z) {
  geometry_msgs::TransformStamped message;
  message.header.frame_id = parent;
  message.child_frame_id = child;
  message.transform.translation.x = x;
  message.transform.translation.y = y;
  message.transform.translation.z = z;
  message.transform.rotation.w = 1.0;
  return message;
}

/// An optical frame in that of a camera that looks along x.
geometry_msgs::TransformStamped optical(const std::string& camera) {
  geometry_msgs::TransformStamped message = transform(camera, camera + "_optical", 0.0, 0.0, 0.0);
  message.transform.rotation.x = message.transform.rotation.z = -0.5;
  message.transform.rotation.y = message.transform.rotation.w = 0.5;
  message.transform.rotation.x = -0.5;
  return message;
}

class BagMountTest : public testing::Test {
 protected:
  void write(const std::vector<geometry_msgs::TransformStamped>& transforms) const {
    rosbag::Bag bag(path_, rosbag::bagmode::Write);
    sensor_msgs::CompressedImage image;
    image.header.frame_id = "mast_optical";
    bag.write("/camera/compressed", ros::Time(1.0), image);
    sensor_msgs::NavSatFix fix;
    fix.header.frame_id = "/gps";
    bag.write("/gps/fix", ros::Time(1.0), fix);
    for (const auto& one : transforms) {  // several publishers
      tf2_msgs::TFMessage message;
      message.transforms.push_back(one);
      bag.write("/tf_static", ros::Time(1.0), message);
    }
  }
  std::optional<SensorMount> mount(const std::string& base = "base_link") const {
    return BagReader(path_).mount("/camera", "/gps/fix", base);
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_ / "recording.bag";
};

TEST_F(BagMountTest, FollowsTheChainOfFrames) {
  write(
      {transform("base_link", "mast", 0.3, 0.1, 1.0), optical("mast"), transform("base_link", "gps", -0.5, 0.3, 0.4)});
  const auto found = mount();
  ASSERT_TRUE(found);
  EXPECT_LT((found->camera.position_m - Eigen::Vector3d(0.3, 0.1, 1.0)).norm(), 1e-9);
  EXPECT_LT((found->camera.ahead() - Eigen::Vector3d::UnitX()).norm(), 1e-9);
  EXPECT_LT((found->antenna_m - Eigen::Vector3d(-0.5, 0.3, 0.4)).norm(), 1e-9);
}

TEST_F(BagMountTest, WithoutAnAntennaItIsAtTheCamera) {
  write({transform("base_link", "mast", 0.3, 0.1, 1.0), optical("mast")});
  ASSERT_TRUE(mount());
  EXPECT_LT((mount()->antenna_m - Eigen::Vector3d(0.3, 0.1, 1.0)).norm(), 1e-9);
}

TEST_F(BagMountTest, IsNothingWithoutTheFrames) {
  write({});
  EXPECT_FALSE(mount()) << "no /tf_static";
  write({transform("base_link", "arm", 0.3, 0.1, 1.0), optical("mast")});
  EXPECT_FALSE(mount()) << "not connected";
  write({transform("base_link", "mast", 0.3, 0.1, 1.0), optical("mast")});
  EXPECT_FALSE(mount("base_footprint"));
}

TEST_F(BagMountTest, LeavesOutTransformsThatAreNone) {
  auto broken = transform("base_link", "mast", std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0);
  auto scaled = transform("base_link", "mast", 1.0, 0.0, 0.0);
  scaled.transform.rotation.w = 3.0;
  write({broken, scaled, transform("mast", "mast", 0.0, 0.0, 0.0), transform("", "mast", 0.0, 0.0, 0.0),
         optical("mast")});
  EXPECT_FALSE(mount());
}

TEST_F(BagMountTest, RefusesARobotOfAKilometre) {
  write({transform("base_link", "mast", 1000.0, 0.0, 0.0), optical("mast")});
  EXPECT_THAT(test::refusalOf<BagError>([&] { mount(); }),
              testing::HasSubstr("/tf_static: the camera must be at most 100 m"));
}

}  // namespace
}  // namespace visual_localization

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/NavSatFix.h>
#include <tf2_msgs/TFMessage.h>

#include "bag/recorded_mount.h"
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

/// In the frame of a camera that looks along x.
geometry_msgs::TransformStamped optical(const std::string& camera) {
  geometry_msgs::TransformStamped message = transform(camera, camera + "_optical", 0.0, 0.0, 0.0);
  message.transform.rotation.x = message.transform.rotation.z = -0.5;
  message.transform.rotation.y = message.transform.rotation.w = 0.5;
  message.transform.rotation.x = -0.5;
  return message;
}

class BagMountTest : public testing::Test {
 protected:
  using Transforms = std::vector<geometry_msgs::TransformStamped>;

  void write(const Transforms& transforms, const std::string& topic = "/tf_static") const {
    write(path_, transforms, topic);
  }
  void write(const std::string& path, const Transforms& transforms, const std::string& topic,
             const Transforms& moving = {}) const {
    rosbag::Bag bag(path, rosbag::bagmode::Write);
    sensor_msgs::CompressedImage image;
    image.header.frame_id = image_frame_;
    bag.write("/camera/compressed", ros::Time(1.0), image);
    sensor_msgs::NavSatFix fix;
    fix.header.frame_id = fix_frame_;
    bag.write("/gps/fix", ros::Time(1.0), fix);
    for (const auto& one : transforms) write(bag, topic, one);  // several publishers
    for (const auto& one : moving) write(bag, "/tf", one);
  }
  std::optional<SensorMount> mount(const std::string& base = "base_link",
                                   const std::optional<std::string>& antenna = "gps") const {
    const auto found = recordedMount(BagReader(path_), {base, "/camera", antenna}, others_);
    return found ? std::optional<SensorMount>(found->mount) : std::nullopt;
  }
  std::string refusal(const std::string& base = "base_link") const {
    return test::refusalOf<BagError>([&] { mount(base); });
  }
  void expectPlain(const std::optional<SensorMount>& found) const {
    ASSERT_TRUE(found);
    EXPECT_LT((found->camera.position_m - Eigen::Vector3d(0.3, 0.1, 1.0)).norm(), 1e-9);
    EXPECT_LT((found->camera.ahead() - Eigen::Vector3d::UnitX()).norm(), 1e-9);
    EXPECT_LT((found->antenna_m - Eigen::Vector3d(-0.5, 0.3, 0.4)).norm(), 1e-9);
  }
  static Transforms plain() {
    return {transform("base_link", "mast", 0.3, 0.1, 1.0), optical("mast"),
            transform("base_link", "gps", -0.5, 0.3, 0.4)};
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_ / "recording.bag";
  std::string image_frame_ = "mast_optical";
  std::string fix_frame_ = "/gps";
  std::vector<std::string> others_ = {};

 private:
  static void write(rosbag::Bag& bag, const std::string& topic, const geometry_msgs::TransformStamped& one) {
    tf2_msgs::TFMessage message;
    message.transforms.push_back(one);
    bag.write(topic, ros::Time(1.0), message);
  }
};

TEST_F(BagMountTest, FollowsTheChainOfFrames) {
  write(plain());
  expectPlain(mount());
}

TEST_F(BagMountTest, TakesWhatNeverChangesInTf) {
  write(plain(), "/tf");
  expectPlain(mount());
  auto turned = plain();
  turned[0].transform.translation.z = 1.2;
  write(path_, plain(), "/tf", turned);
  EXPECT_THAT(refusal(), testing::HasSubstr("since 'base_link' to 'mast' moves"));
}

TEST_F(BagMountTest, TakesWhatTfStaticSaysBeforeTf) {
  write(path_, plain(), "/tf_static",
        {transform("base_link", "mast", 9.0, 0.0, 0.0), transform("odom", "base_link", 1.0, 0.0, 0.0)});
  expectPlain(mount());
}

TEST_F(BagMountTest, IsNothingWithoutFrames) {
  write({});
  EXPECT_FALSE(mount()) << "no transforms at all";
  write({transform("odom", "base_link", 1.0, 0.0, 0.0), transform("odom", "base_link", 2.0, 0.0, 0.0)}, "/tf");
  EXPECT_FALSE(mount()) << "the robot moves, and nobody says more";
}

TEST_F(BagMountTest, RefusesFramesThatDoNotTell) {
  write({transform("base_link", "arm", 0.3, 0.1, 1.0), optical("mast")});
  EXPECT_THAT(refusal(), testing::AllOf(testing::HasSubstr("the images' frame"), testing::HasSubstr("'base_link'"),
                                        testing::HasSubstr("'mast_optical'"),
                                        testing::HasSubstr("arm, base_link, mast, mast_optical")));
  write({transform("base_link", "mast", 0.3, 0.1, 1.0), optical("mast")});
  EXPECT_THAT(refusal(), testing::AllOf(testing::HasSubstr("the fixes' frame"), testing::HasSubstr("'gps'"),
                                        testing::HasSubstr("robot/antenna")));
  EXPECT_TRUE(mount("base_link", std::nullopt)) << "for a drive the camera is enough";
  image_frame_ = "";
  write(plain());
  EXPECT_THAT(refusal(), testing::HasSubstr("'' (empty)"));
  image_frame_ = "usb_cam";
  write(plain());
  EXPECT_THAT(refusal(), testing::HasSubstr("'usb_cam'"));
}

TEST_F(BagMountTest, TakesTheFootprintForTheBase) {
  auto transforms = plain();
  for (auto& one : transforms) {
    if (one.header.frame_id == "base_link") one.header.frame_id = "base_footprint";
  }
  write(transforms);
  expectPlain(mount());
  EXPECT_THAT(refusal("chassis"), testing::HasSubstr("'chassis'"));
}

TEST_F(BagMountTest, TakesABodyFrameForWhatItIs) {
  image_frame_ = "mast";
  write(plain());
  expectPlain(mount());
}

TEST_F(BagMountTest, TakesTheFramesOfTheFirstPartOfARecording) {
  others_ = {path_, folder_ / "first.bag"};
  write(others_[1], plain(), "/tf_static");
  write({});
  expectPlain(mount());
}

TEST_F(BagMountTest, NamesTransformsThatAreNone) {
  const auto refusedWith = [&](const geometry_msgs::TransformStamped& broken) {
    write({broken, optical("mast"), transform("mast", "mast", 0.0, 0.0, 0.0), transform("", "mast", 0.0, 0.0, 0.0)});
    return refusal();
  };
  EXPECT_THAT(refusedWith(transform("base_link", "mast", std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0)),
              testing::HasSubstr("since 'base_link' to 'mast' is not finite"));
  auto broken = transform("base_link", "mast", 1.0, 0.0, 0.0);
  broken.transform.rotation.w = 3.0;
  EXPECT_THAT(refusedWith(broken), testing::HasSubstr("has a quaternion that is not of unit length"));
  broken.transform.rotation.w = 0.0;
  EXPECT_THAT(refusedWith(broken), testing::HasSubstr("has a quaternion of zeros"));
}

TEST_F(BagMountTest, RefusesTwoValuesForOneFrame) {
  auto twice = plain();
  twice.push_back(transform("base_link", "mast", 0.3, 0.1, 1.5));
  write(twice);
  EXPECT_THAT(refusal(), testing::HasSubstr("'base_link' to 'mast' has two values in /tf_static"));
  twice.back() = transform("roof", "mast", 0.3, 0.1, 1.0);
  write(twice);
  EXPECT_THAT(refusal(), testing::HasSubstr("'mast' has two values in /tf_static, in 'base_link' and in 'roof'"));
  twice.back() = plain()[0];
  write(twice);
  expectPlain(mount());
}

TEST_F(BagMountTest, RefusesFramesInACircle) {
  write(
      {transform("mast", "base_link", 0.0, 0.0, 1.0), transform("base_link", "mast", 0.0, 0.0, 1.0), optical("mast")});
  EXPECT_THAT(refusal(), testing::HasSubstr("make a circle"));
}

TEST_F(BagMountTest, RefusesARobotOfAKilometre) {
  auto far = plain();
  far[0].transform.translation.x = 1000.0;
  write(far);
  EXPECT_THAT(refusal(), testing::HasSubstr("the camera must be at most 100 m"));
}

}  // namespace
}  // namespace visual_localization

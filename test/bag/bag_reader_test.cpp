#include "visual_localization/bag/bag_reader.h"

#include <cmath>
#include <cstdlib>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <opencv2/imgcodecs.hpp>
#include <rosbag/bag.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/NavSatFix.h>
#include <std_msgs/String.h>

#include "test/support/refusal.h"
#include "test/support/temporary_folder.h"
#include "visual_localization/ros/image_conversion.h"

namespace visual_localization {
namespace {

using testing::AllOf;
using testing::HasSubstr;

sensor_msgs::CompressedImage jpeg(double stamp_s) {
  sensor_msgs::CompressedImage message;
  message.header.stamp = ros::Time(stamp_s);
  message.format = "jpeg";
  cv::imencode(".jpg", cv::Mat(32, 48, CV_8UC1, cv::Scalar(100)), message.data);
  return message;
}

sensor_msgs::Image raw(double stamp_s) {
  sensor_msgs::Image message;
  message.header.stamp = ros::Time(stamp_s);
  message.width = message.step = 24;
  message.height = 20;
  message.encoding = "mono8";
  message.data.assign(24 * 20, 50);
  return message;
}

sensor_msgs::NavSatFix fix(double stamp_s, bool valid) {
  sensor_msgs::NavSatFix message;
  message.header.stamp = ros::Time(stamp_s);
  message.status.status = valid ? 0 : -1;
  message.latitude = valid ? 48.5 : std::numeric_limits<double>::quiet_NaN();
  message.longitude = 9.05;
  message.altitude = 400.0;
  return message;
}

/// Three images and four fixes, one of each without a stamp in its header.
void writeBag(const std::string& path) {
  rosbag::Bag bag(path, rosbag::bagmode::Write);
  for (const double time_s : {1.0, 2.0, 3.0}) {
    bag.write("/camera/compressed", ros::Time(time_s + 0.25), jpeg(time_s == 2.0 ? 0.0 : time_s));
  }
  for (const double time_s : {1.0, 1.5, 2.0}) bag.write("/gps", ros::Time(time_s), fix(time_s, time_s != 1.5));
  bag.write("/gps", ros::Time(2.5), fix(0.0, true));
  bag.write("/talk", ros::Time(2.5), std_msgs::String());
}

/// Who publishes: two of them may have the same topic.
template <class T>
boost::shared_ptr<ros::M_string> publisher() {
  namespace traits = ros::message_traits;
  return boost::make_shared<ros::M_string>(ros::M_string{{"type", traits::DataType<T>::value()},
                                                         {"md5sum", traits::MD5Sum<T>::value()},
                                                         {"message_definition", traits::Definition<T>::value()}});
}

class BagReaderTest : public testing::Test {
 protected:
  void SetUp() override { writeBag(path_); }
  std::string openRefusal(const std::string& path) const {
    return test::refusalOf<BagError>([&path] { BagReader{path}; });
  }

  test::TemporaryFolder folder_;
  std::string path_ = folder_ / "recording.bag";
};

TEST_F(BagReaderTest, FindsCompressedImagesByTheirBaseName) {
  const BagReader bag(path_);
  for (const char* topic : {"/camera", "/camera/compressed"}) {
    const BagImages images = bag.images(topic);
    EXPECT_EQ(images.topic(), "/camera/compressed");
    ASSERT_EQ(images.size(), 3U);
    EXPECT_EQ(images.read(0).stamp_ns, 1'000'000'000);
    EXPECT_EQ(images.read(0).decode().size(), cv::Size(48, 32));
  }
}

TEST_F(BagReaderTest, UsesTheTimeOfRecordingWithoutStamp) {
  const BagReader bag(path_);
  EXPECT_EQ(bag.images("/camera").read(1).stamp_ns, 2'250'000'000);
  EXPECT_EQ(bag.fixes("/gps").back().stamp_ns, 2'500'000'000);
}

TEST_F(BagReaderTest, ReadsOdometryOfTheRobot) {
  EXPECT_THAT(test::refusalOf<BagError>([&] { BagReader(path_).odometry("/odom", "base_link", "map"); }),
              testing::AllOf(HasSubstr("no odometry topic '/odom'"), HasSubstr("odometry topics in this bag: none")));
  nav_msgs::Odometry odometry;
  odometry.child_frame_id = "base_link";
  odometry.pose.pose.orientation.w = 1.0;
  {
    rosbag::Bag bag(path_, rosbag::bagmode::Write);
    for (const double time_s : {1.0, 2.0}) {
      odometry.header.stamp = ros::Time(time_s);
      odometry.pose.pose.position.x = 3.0 * time_s;
      bag.write("/odom", ros::Time(time_s), odometry);
      odometry.pose.pose.position.x = std::numeric_limits<double>::quiet_NaN();
      if (time_s > 1.0) bag.write("/wrong", ros::Time(time_s), odometry);
    }
  }
  const BagReader bag(path_);
  const auto readings = bag.odometry("/odom", "base_link", "map");
  ASSERT_EQ(readings.size(), 2U);
  EXPECT_EQ(readings[1].stamp_ns, 2'000'000'000);
  EXPECT_EQ(readings[1].position_m, Eigen::Vector2d(6.0, 0.0));
  EXPECT_THAT(test::refusalOf<BagError>([&] { bag.odometry("/wrong", "base_link", "map"); }),
              HasSubstr("/wrong: message 0: its pose is not finite"));
  EXPECT_THAT(test::refusalOf<BagError>([&] { bag.odometry("/odom", "robot", "map"); }),
              HasSubstr("instead of 'robot'"));
}

TEST_F(BagReaderTest, ImagesKeepTheirBagOpen) {
  const BagImages images = BagReader(path_).images("/camera");
  EXPECT_EQ(images.read(2).decode().size(), cv::Size(48, 32));
}

TEST_F(BagReaderTest, MostImagesDecideTheUsualSize) {
  EXPECT_EQ(BagReader(path_).images("/camera").usualSize(), cv::Size(48, 32));
  {
    rosbag::Bag bag(path_, rosbag::bagmode::Write);
    for (const double time_s : {1.0, 2.0, 3.0, 4.0}) {
      sensor_msgs::CompressedImage other = jpeg(time_s);
      if (time_s < 3.0) cv::imencode(time_s < 2.0 ? ".jpg" : ".png", cv::Mat(600, 800, CV_8UC1), other.data);
      if (time_s == 2.0) other.data.resize(20);  // its size is cut off
      bag.write("/camera/compressed", ros::Time(time_s), other);
    }
    bag.write("/raw", ros::Time(1.0), raw(1.0));
    bag.write("/broken/compressed", ros::Time(1.0), sensor_msgs::CompressedImage());
  }
  const BagReader bag(path_);
  EXPECT_EQ(bag.images("/camera").usualSize(), cv::Size(48, 32));
  EXPECT_EQ(bag.images("/camera").read(0).size, cv::Size(800, 600));
  EXPECT_EQ(bag.images("/camera").read(1).size, cv::Size());
  EXPECT_EQ(bag.images("/raw").usualSize(), cv::Size(24, 20));
  EXPECT_EQ(bag.images("/broken").usualSize(), cv::Size());
}

TEST_F(BagReaderTest, PrefersRawImages) {
  {
    rosbag::Bag bag(path_, rosbag::bagmode::Append);
    bag.write("/camera", ros::Time(1.0), raw(1.0));
  }
  const BagReader bag(path_);
  const BagImages images = bag.images("/camera");
  ASSERT_EQ(images.size(), 1U);
  EXPECT_EQ(images.read(0).decode().size(), cv::Size(24, 20));
}

TEST_F(BagReaderTest, KeepsAllFixes) {
  const std::vector<Fix> fixes = BagReader(path_).fixes("/gps");
  ASSERT_EQ(fixes.size(), 4U);
  EXPECT_TRUE(fixes[0].has_fix);
  EXPECT_DOUBLE_EQ(fixes[0].position.latitude_deg, 48.5);
  EXPECT_FALSE(fixes[1].has_fix);
  EXPECT_TRUE(std::isnan(fixes[1].position.latitude_deg));
}

TEST_F(BagReaderTest, RawAndCompressedImagesOnOneTopicAreRefused) {
  const std::string path = folder_ / "both.bag";
  {
    rosbag::Bag bag(path, rosbag::bagmode::Write);
    bag.write("/camera", ros::Time(1.0), raw(1.0), publisher<sensor_msgs::Image>());
    bag.write("/camera", ros::Time(2.0), jpeg(2.0), publisher<sensor_msgs::CompressedImage>());
  }
  const BagReader bag(path);
  EXPECT_THAT(test::refusalOf<BagError>([&] { bag.images("/camera"); }),
              AllOf(HasSubstr("'/camera'"), HasSubstr("raw and compressed")));
}

TEST_F(BagReaderTest, NamesTheTopicsThatThereAre) {
  const BagReader bag(path_);
  EXPECT_THAT(test::refusalOf<BagError>([&] { bag.images("/eye"); }),
              AllOf(HasSubstr("'/eye'"), HasSubstr("/camera/compressed")));
  EXPECT_THAT(test::refusalOf<BagError>([&] { bag.fixes("/position"); }),
              AllOf(HasSubstr("'/position'"), HasSubstr("/gps")));
  EXPECT_THAT(test::refusalOf<BagError>([&] { bag.fixes("/talk"); }), HasSubstr("no fix topic"));
  EXPECT_TRUE(bag.hasFixes("/gps"));
  EXPECT_FALSE(bag.hasFixes("/talk"));
}

TEST_F(BagReaderTest, SaysWhyAFileIsNoBag) {
  EXPECT_THAT(openRefusal(folder_ / "absent.bag"), HasSubstr("No such file"));
  EXPECT_THAT(openRefusal(folder_.path()), HasSubstr("is a folder"));
  test::writeAll(folder_ / "empty.bag", "");
  EXPECT_THAT(openRefusal(folder_ / "empty.bag"), HasSubstr("is empty"));
  test::writeAll(folder_ / "noise.bag", std::string(10000, '\x7F'));
  EXPECT_NE(openRefusal(folder_ / "noise.bag"), "accepted");
}

TEST_F(BagReaderTest, EveryTruncatedBagIsRefused) {
  const std::string whole = test::readAll(path_);
  for (std::size_t length = 0; length < whole.size(); length += 1 + whole.size() / 100) {
    test::writeAll(path_, whole.substr(0, length));
    EXPECT_NE(openRefusal(path_), "accepted") << length;
  }
}

TEST_F(BagReaderTest, AnotherMessageDefinitionIsRefused) {
  std::string bytes = test::readAll(path_);
  const std::string md5 = ros::message_traits::md5sum<sensor_msgs::NavSatFix>();
  for (std::size_t at = bytes.find(md5); at != std::string::npos; at = bytes.find(md5, at + 1)) bytes[at] = 'f';
  test::writeAll(path_, bytes);
  EXPECT_THAT(test::refusalOf<BagError>([&] { BagReader(path_).fixes("/gps"); }), HasSubstr("another definition"));
}

TEST_F(BagReaderTest, AnImageWhoseLengthLiesIsUnusable) {
  std::string bytes = test::readAll(path_);
  // Behind the format, a string with its own length, stands the length of the JPEG.
  const std::string format("\x04\0\0\0jpeg", 8);
  const std::size_t at = bytes.find(format);
  ASSERT_NE(at, std::string::npos);
  bytes.replace(at + format.size(), 4, "\xFF\xFF\xFF\x7F");
  test::writeAll(path_, bytes);
  const BagReader bag(path_);
  EXPECT_THROW(bag.images("/camera").read(0).decode(), ImageError);
}

TEST_F(BagReaderTest, RecordingsOfTheDataFolderCanBeRead) {
  const char* folder = std::getenv("VISUAL_LOCALIZATION_DATA");
  if (folder == nullptr) GTEST_SKIP() << "VISUAL_LOCALIZATION_DATA is not set";
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".bag") continue;
    const BagReader bag(entry.path().string());
    const BagImages images = bag.images("/stereo/left/image_raw");
    ASSERT_GT(images.size(), 0U);
    EXPECT_FALSE(images.read(images.size() / 2).decode().empty());
    EXPECT_GT(bag.fixes("/gps/fix").size(), 1U);
  }
}

}  // namespace
}  // namespace visual_localization

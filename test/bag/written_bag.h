#pragma once

#include <cstddef>
#include <fstream>
#include <memory>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <rosbag/bag.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/NavSatFix.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "bag/bag_file.h"
#include "test/support/refusal.h"
#include "test/support/temporary_folder.h"
#include "visual_localization/bag/bag_reader.h"
#include "visual_localization/ros/image_conversion.h"

namespace visual_localization::test {

/// Bags, and bytes that may be none.
class BagFileTest : public testing::Test {
 protected:
  /// Twelve images and fixes in several chunks.
  std::string writeBag(rosbag::compression::CompressionType compression) {
    const std::string path = folder_ / ("good" + std::to_string(static_cast<int>(compression)) + ".bag");
    rosbag::Bag bag(path, rosbag::bagmode::Write);
    bag.setCompression(compression);
    bag.setChunkThreshold(2000);
    for (int i = 0; i < 12; ++i) {
      const ros::Time stamp(1000.0 + i);
      sensor_msgs::CompressedImage image;
      image.header.stamp = stamp;
      image.format = "jpeg";
      cv::imencode(".jpg", cv::Mat(32, 48, CV_8UC1, cv::Scalar(10 * i)), image.data);
      bag.write("/camera/compressed", stamp, image);
      sensor_msgs::NavSatFix fix;
      fix.header.stamp = stamp;
      fix.latitude = 48.5;
      bag.write("/gps/fix", stamp, fix);
    }
    bag.close();
    return path;
  }

  /// Images of 1 MB, each in a compressed chunk of its own.
  std::string writeLargeMessages(int count) {
    const std::string path = folder_ / "large.bag";
    rosbag::Bag bag(path, rosbag::bagmode::Write);
    bag.setCompression(rosbag::compression::LZ4);
    bag.setChunkThreshold(1000);
    sensor_msgs::CompressedImage image;
    image.data.resize(1'000'000);
    for (int i = 0; i < count; ++i) bag.write("/camera/compressed", ros::Time(1000.0 + i), image);
    bag.close();
    return path;
  }

  std::string writeBytes(const std::string& bytes) {
    const std::string path = folder_ / "mutated.bag";
    writeAll(path, bytes);
    return path;
  }

  static std::unique_ptr<const bag::Bytes> inMemory(const std::string& bytes) {
    return std::make_unique<bag::MemoryBytes>(bytes);
  }

  static std::string refusal(const std::string& path) {
    return test::refusalOf<bag::DamagedBag>([&path] {
      bag::BagFile bag(std::make_unique<bag::FileBytes>(path));
      std::set<std::uint32_t> all;
      for (const auto& [id, connection] : bag.connections()) all.insert(id);
      for (const bag::Message& message : bag.messages(all)) bag.read(message);
    });
  }

  /// Bytes beyond those that the process has.
  static void limitMemory(std::size_t most_bytes) {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // these need far more addresses
    std::size_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    const std::size_t most = pages * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)) + most_bytes;
    const rlimit memory{most, most};
    ::setrlimit(RLIMIT_AS, &memory);
#endif
  }

  /// 0 when it came to an end by itself.
  static int signalWhileReading(const std::string& path) {
    const pid_t child = ::fork();
    if (child == 0) {
      limitMemory(1UL << 30U);
      ::alarm(20);
      allowRefusal([&] { use(path); });
      ::_exit(0);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  }

 private:
  template <class Action>
  static void allowRefusal(Action action) {
    try {
      action();
    } catch (const BagError&) {
    } catch (const ImageError&) {
    }
  }

  /// What programs do with a bag, going on where a program would not.
  static void use(const std::string& path) {
    const BagReader bag(path);
    allowRefusal([&] { bag.fixes("/gps/fix"); });
    const BagImages images = bag.images("/camera");
    for (std::size_t i = 0; i < images.size(); ++i) allowRefusal([&] { images.read(i).decode(); });
  }

  TemporaryFolder folder_;
};

}  // namespace visual_localization::test

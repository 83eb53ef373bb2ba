#include "visual_localization/ros/bag_validator.h"

#include <csignal>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <rosbag/bag.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/NavSatFix.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "test/support/temporary_folder.h"
#include "visual_localization/ros/bag_reader.h"
#include "visual_localization/ros/image_conversion.h"

namespace visual_localization {
namespace {

using rosbag::compression::CompressionType;
using testing::HasSubstr;

const CompressionType kCompressions[] = {rosbag::compression::Uncompressed, rosbag::compression::BZ2,
                                         rosbag::compression::LZ4};

class BagValidatorTest : public testing::Test {
 protected:
  /// Twelve images and fixes in several chunks.
  std::string writeBag(CompressionType compression) {
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

  std::string writeBytes(const std::string& bytes) {
    const std::string path = folder_ / "mutated.bag";
    test::writeAll(path, bytes);
    return path;
  }

  test::TemporaryFolder folder_;
};

/// What a program does with a bag.
void readAll(const std::string& path) {
  const BagReader bag(path);
  bag.fixes("/gps/fix");
  const BagImages images = bag.images("/camera");
  for (std::size_t i = 0; i < images.size(); ++i) {
    try {
      images.read(i).decode();
    } catch (const ImageError&) {
    }
  }
}

/// The signal that ended a process that read the bag; 0 when it came to an end by itself.
int signalWhileReading(const std::string& path) {
  const pid_t child = ::fork();
  if (child == 0) {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // these need far more addresses
    const rlimit memory{1UL << 31U, 1UL << 31U};
    ::setrlimit(RLIMIT_AS, &memory);
#endif
    ::alarm(20);
    try {
      readAll(path);
    } catch (const BagError&) {
    }
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFSIGNALED(status) ? WTERMSIG(status) : 0;
}

/// One of: a flipped byte, a wrong length, a cut, a piece in the wrong place.
std::string mutated(std::string bytes, std::mt19937& random) {
  const auto below = [&random](std::size_t limit) {
    return std::uniform_int_distribution<std::size_t>(0, limit - 1)(random);
  };
  switch (below(4)) {
    case 0:
      bytes[below(bytes.size())] = static_cast<char>(below(256));
      break;
    case 1: {
      const std::size_t at = below(bytes.size() - 4);
      const std::uint32_t values[] = {0U,          1U,          0xFFFFFFFFU,
                                      0x7FFFFFFFU, 0x10000000U, static_cast<std::uint32_t>(below(5000))};
      const std::uint32_t value = values[below(6)];
      for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<char>(value >> (8 * i));
      break;
    }
    case 2:
      bytes.resize(below(bytes.size()));
      break;
    default: {
      const std::size_t length = 1 + below(200);
      const std::string piece = bytes.substr(below(bytes.size()), length);
      bytes.replace(below(bytes.size()), piece.size(), piece);
    }
  }
  return bytes;
}

TEST_F(BagValidatorTest, AcceptsEveryCompression) {
  for (const CompressionType compression : kCompressions) {
    const std::string path = writeBag(compression);
    EXPECT_NO_THROW(validateBag(path));
    EXPECT_EQ(BagReader(path).fixes("/gps/fix").size(), 12u);
  }
}

TEST_F(BagValidatorTest, EveryCutIsRefused) {
  const std::string bytes = test::readAll(writeBag(rosbag::compression::Uncompressed));
  for (std::size_t size = 1; size < bytes.size(); size += 37) {
    EXPECT_THROW(validateBag(writeBytes(bytes.substr(0, size))), DamagedBag) << size;
  }
}

TEST_F(BagValidatorTest, TheReaderNamesThePath) {
  std::string bytes = test::readAll(writeBag(rosbag::compression::Uncompressed));
  bytes[13] = '\xFF';  // the length of the first header
  const std::string path = writeBytes(bytes);
  try {
    const BagReader bag(path);
    ADD_FAILURE() << "accepted";
  } catch (const BagError& error) {
    EXPECT_THAT(error.what(), testing::StartsWith(path));
    EXPECT_THAT(error.what(), HasSubstr("damaged"));
  }
}

TEST_F(BagValidatorTest, OtherVersionsAndFilesAreRefused) {
  std::string bytes = test::readAll(writeBag(rosbag::compression::Uncompressed));
  bytes[9] = '1';
  EXPECT_THROW(validateBag(writeBytes(bytes)), DamagedBag);
  EXPECT_THROW(validateBag(writeBytes("no bag at all")), DamagedBag);
}

TEST_F(BagValidatorTest, NoMutationKillsTheReader) {
  std::mt19937 random(3);
  for (const CompressionType compression : kCompressions) {
    const std::string bytes = test::readAll(writeBag(compression));
    for (int i = 0; i < 150; ++i) {
      const std::string path = writeBytes(mutated(bytes, random));
      ASSERT_EQ(signalWhileReading(path), 0) << "compression " << compression << ", mutation " << i;
    }
  }
}

}  // namespace
}  // namespace visual_localization

#include "bag/bag_writer.h"

#include <csignal>
#include <cstring>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/NavSatFix.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/files.h"
#include "test/support/temporary_folder.h"
#include "visual_localization/bag/bag_reader.h"

namespace visual_localization {
namespace {

sensor_msgs::NavSatFix fixAt(int second) {
  sensor_msgs::NavSatFix fix;
  fix.header.stamp = ros::Time(1000 + second, 0);
  fix.latitude = 48.5;
  fix.longitude = 9.0 + 1e-5 * second;
  return fix;
}

class BagWriterTest : public testing::Test {
 protected:
  static void writeFixes(BagWriter& bag, int from, int to) {
    for (int i = from; i < to; ++i) ASSERT_TRUE(bag.write("/gps/fix", ros::Time(1000 + i, 0), fixAt(i)));
  }
  std::size_t fixesIn(const std::string& path) const { return BagReader(path).fixes("/gps/fix").size(); }

  test::TemporaryFolder folder_;
  const std::string path_ = folder_ / "session.bag";
};

TEST_F(BagWriterTest, IsWholeAfterEachSync) {
  BagWriter bag(path_);
  for (int part = 0; part < 5; ++part) {
    writeFixes(bag, 10 * part, 10 * part + 10);
    bag.sync();
    EXPECT_EQ(fixesIn(path_), 10U * (part + 1));
  }
}

TEST_F(BagWriterTest, RosbagReadsIt) {
  {
    BagWriter bag(path_);
    writeFixes(bag, 0, 7);
    bag.sync();
    ASSERT_TRUE(bag.write("/odom", ros::Time(1010, 0), nav_msgs::Odometry(), true));
    writeFixes(bag, 7, 9);
    bag.sync();
  }
  rosbag::Bag bag(path_);
  rosbag::View view(bag);
  int fixes = 0;
  for (const rosbag::MessageInstance& instance : view) {
    const auto fix = instance.instantiate<sensor_msgs::NavSatFix>();
    if (!fix) continue;
    EXPECT_EQ(fix->header.stamp, fixAt(fixes).header.stamp);
    EXPECT_EQ(fix->longitude, fixAt(fixes).longitude);
    ++fixes;
  }
  for (const rosbag::ConnectionInfo* connection : view.getConnections()) {
    EXPECT_EQ(connection->header->count("latching"), connection->topic == "/odom" ? 1U : 0U);
  }
  EXPECT_EQ(fixes, 9);
  EXPECT_EQ(view.size(), 10U);
}

TEST_F(BagWriterTest, KeepsWhatWasSyncedWhenTheProcessIsKilled) {
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    BagWriter bag(path_);
    for (int i = 0; i < 4; ++i) bag.write("/gps/fix", ros::Time(1000 + i, 0), fixAt(i));
    bag.sync();
    bag.write("/gps/fix", ros::Time(1004, 0), fixAt(4));
    ::raise(SIGKILL);
  }
  ASSERT_EQ(::waitpid(child, nullptr, 0), child);
  EXPECT_EQ(fixesIn(path_), 4U);
}

TEST_F(BagWriterTest, IsWholeWhereverTheNextPartIsCutOff) {
  std::string whole;
  std::uint64_t synced = 0;
  {
    BagWriter bag(path_);
    writeFixes(bag, 0, 4);
    bag.sync();
    synced = bag.size();
    whole = readFile(path_);
    writeFixes(bag, 4, 6);
    bag.sync();
  }
  // The second chunk reaches the disk before the header does.
  const std::string both = readFile(path_);
  const std::string cut_path = folder_ / "cut.bag";
  for (std::size_t size = synced; size < both.size(); size += 37) {
    std::ofstream(cut_path, std::ios::binary) << whole << both.substr(synced, size - synced);
    EXPECT_EQ(fixesIn(cut_path), 4U) << "cut at " << size;
  }
}

TEST_F(BagWriterTest, SaysWhatASyncCosts) {
  BagWriter bag(path_);
  EXPECT_EQ(bag.waiting(), 0U);
  writeFixes(bag, 0, 4);
  EXPECT_GT(bag.waiting(), 4 * sizeof(double) * 12);
  bag.sync();
  EXPECT_EQ(bag.waiting(), 0U);
  const std::uint64_t index = bag.indexSize();
  writeFixes(bag, 4, 8);
  const std::uint64_t before = bag.size();
  bag.sync();
  EXPECT_GT(bag.indexSize(), index);
  EXPECT_GT(bag.size() - before, bag.indexSize());
}

TEST_F(BagWriterTest, AnEmptyOneIsABag) {
  { BagWriter bag(path_); }
  EXPECT_FALSE(BagReader(path_).hasFixes("/gps/fix"));
}

TEST_F(BagWriterTest, NeverReplacesAFile) {
  writeFile(path_, "mine");
  EXPECT_THROW(BagWriter bag(path_), FileError);
  EXPECT_EQ(readFile(path_), "mine");
}

TEST_F(BagWriterTest, GoesOnWhenTheDiskHasSpaceAgain) {
  BagWriter bag(path_);
  writeFixes(bag, 0, 4);
  bag.sync();
  writeFixes(bag, 4, 8);
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const rlimit full{bag.size() + 100, before.rlim_max};
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  ::setrlimit(RLIMIT_FSIZE, &full);
  EXPECT_THROW(bag.sync(), FileError);
  EXPECT_EQ(fixesIn(path_), 4U);
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  bag.sync();
  EXPECT_EQ(fixesIn(path_), 8U);
}

TEST_F(BagWriterTest, LosesMessagesInsteadOfMemory) {
  BagWriter bag(path_);
  sensor_msgs::NavSatFix large = fixAt(0);
  large.header.frame_id.assign(10'000'000, 'x');
  int kept = 0;
  for (int i = 0; i < 10; ++i) kept += bag.write("/gps/fix", ros::Time(1000 + i, 0), large) ? 1 : 0;
  EXPECT_EQ(kept, 6);
}

}  // namespace
}  // namespace visual_localization

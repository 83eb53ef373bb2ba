#include "bag/bag_file.h"

#include <csignal>
#include <functional>
#include <random>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <rosbag/bag.h>
#include <roslz4/lz4s.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/NavSatFix.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "test/support/temporary_folder.h"
#include "visual_localization/bag/bag_reader.h"
#include "visual_localization/ros/image_conversion.h"

namespace visual_localization {
namespace {

using bag::BagFile;
using bag::DamagedBag;
using bag::UnsupportedBag;
using rosbag::compression::CompressionType;
using testing::HasSubstr;

const CompressionType kCompressions[] = {rosbag::compression::Uncompressed, rosbag::compression::BZ2,
                                         rosbag::compression::LZ4};

class BagFileTest : public testing::Test {
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

/// `action`; a bag or an image may be refused.
template <class Action>
void allowRefusal(Action action) {
  try {
    action();
  } catch (const BagError&) {
  } catch (const ImageError&) {
  }
}

/// What programs do with a bag, and they go on where a program would not.
void readAll(const std::string& path) {
  const BagReader bag(path);
  allowRefusal([&] { bag.fixes("/gps/fix"); });
  const BagImages images = bag.images("/camera");
  for (std::size_t i = 0; i < images.size(); ++i) allowRefusal([&] { images.read(i).decode(); });
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
    allowRefusal([&] { readAll(path); });
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

/// Why a bag cannot be read from its beginning to its end.
std::string refusal(const std::string& path) {
  try {
    BagFile bag(path);
    std::set<std::uint32_t> all;
    for (const auto& [id, connection] : bag.connections()) all.insert(id);
    for (const bag::Message& message : bag.messages(all)) bag.read(message);
  } catch (const DamagedBag& error) {
    return error.what();
  }
  return "accepted";
}

TEST_F(BagFileTest, AcceptsEveryCompression) {
  for (const CompressionType compression : kCompressions) {
    const std::string path = writeBag(compression);
    EXPECT_EQ(refusal(path), "accepted");
    EXPECT_EQ(BagReader(path).fixes("/gps/fix").size(), 12u);
  }
}

TEST_F(BagFileTest, EveryCutIsRefused) {
  const std::string bytes = test::readAll(writeBag(rosbag::compression::Uncompressed));
  for (std::size_t size = 14; size < bytes.size(); size += 37) {
    EXPECT_THROW(BagFile(writeBytes(bytes.substr(0, size))), DamagedBag) << size;
  }
}

TEST_F(BagFileTest, TheReaderNamesThePath) {
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

/// One kind of damage to an uncompressed bag, and what is said about it.
struct Damage {
  const char* text;
  std::function<void(std::string&)> make;
};

/// Replaces what begins with the first, or last, `pattern`.
auto patch(const std::string& pattern, std::size_t after, const std::string& value, bool last = false) {
  return [=](std::string& bytes) {
    const std::size_t at = last ? bytes.rfind(pattern) : bytes.find(pattern);
    ASSERT_NE(at, std::string::npos) << pattern;
    bytes.replace(at + after, value.size(), value);
  };
}

/// Copies `count` bytes that stand `after` the first `pattern` to the same place of the last one.
auto repeat(const std::string& pattern, std::size_t after, std::size_t count) {
  return [=](std::string& bytes) {
    const std::size_t first = bytes.find(pattern);
    ASSERT_NE(first, std::string::npos) << pattern;
    bytes.replace(bytes.rfind(pattern) + after, count, bytes.substr(first + after, count));
  };
}

TEST_F(BagFileTest, NamesEveryKindOfDamage) {
  const std::string good = test::readAll(writeBag(rosbag::compression::Uncompressed));
  const std::string four("\x01\0\0\0", 4);
  const std::string huge = "\xFF\xFF\xFF\xFF";
  const std::string version = "ver=" + four;  // ends the header of an index; its data begins eight bytes behind
  const std::string count("\x0A\0\0\0count=", 10);
  const Damage damages[] = {
      {"a record's header at byte 17 claims 4294967295 bytes", patch("#ROSBAG V2.0\n", 13, huge)},
      {"longer than its header", patch("#ROSBAG V2.0\n", 17, huge)},
      {"has no name", patch("conn_count=", 10, "_")},
      {"does not begin with a bag header", patch("op=\x03", 3, "\x05")},
      {"the unknown type", patch("op=\x03", 3, "\x63")},
      {": bag is not indexed, as after an interrupted recording; `rosbag reindex`",
       patch("index_pos=", 10, std::string(8, '\0'))},
      {"the index lies outside the file", patch("index_pos=", 10, huge + huge)},
      {"field 'chunk_count'", patch("chunk_count=", 0, "Chunk")},
      {"field 'size'", patch("size=", 0, "Size")},
      {"at most 268435456 are accepted", patch("size=", 5, huge)},
      {"another size than it claims", patch("size=", 5, four)},
      {"unknown compression", patch("compression=none", 12, "nine")},
      {"no field 'topic'", patch("topic=", 0, "Topic")},
      {"no field 'type'", patch("type=", 0, "Type")},
      {"no field 'md5sum'", patch("md5sum=", 0, "Md5")},
      {"no field 'message_definition'", patch("message_definition=", 0, "Message", true)},
      {"something else than messages", patch("op=\x02", 3, "\x06")},
      {"field 'time'", patch(std::string("\x0D\0\0\0time=", 9), 4, "Time")},
      {"an index has an unknown version", patch(version, 4, "\x02")},
      {"an index has the wrong size", patch(count, 10, huge)},
      {"an index points beside its messages", patch(version, 20, four)},
      {"description has an unknown version", patch(version, 4, "\x02", true)},
      {"description has the wrong size", patch(count, 10, huge, true)},
      {"description points beside it", patch("chunk_pos=", 10, four)},
      {"described twice", repeat("chunk_pos=", 10, 8)},
      {"lacks a connection", patch("conn_count=", 11, huge)},
      {"ends within a record's header", patch("chunk_count=", 12, huge)},
  };
  for (const Damage& damage : damages) {
    std::string bytes = good;
    damage.make(bytes);
    const std::string path = writeBytes(bytes == good ? "" : bytes);
    try {
      const BagReader bag(path);
      ADD_FAILURE() << "accepted: " << damage.text;
    } catch (const BagError& error) {
      EXPECT_THAT(error.what(), testing::AllOf(testing::StartsWith(path), HasSubstr(damage.text)));
    }
  }
}

std::string number(std::uint64_t value, std::size_t size) {
  std::string bytes;
  for (std::size_t i = 0; i < size; ++i) bytes += static_cast<char>(value >> (8 * i));
  return bytes;
}

std::string record(const std::vector<std::string>& fields, const std::string& data) {
  std::string header;
  for (const std::string& field : fields) header += number(field.size(), 4) + field;
  return number(header.size(), 4) + header + number(data.size(), 4) + data;
}

/// An index of connection 0 with messages at these offsets.
std::string indexOf(const std::vector<std::size_t>& offsets) {
  std::string entries;
  for (const std::size_t offset : offsets) entries += number(0, 8) + number(offset, 4);
  return record({"op=\x04", "ver=" + number(1, 4), "conn=" + number(0, 4), "count=" + number(offsets.size(), 4)},
                entries);
}

/// A bag of fixes in one chunk with an index.
std::string oneChunk(const std::string& compression, std::size_t size, const std::string& packed,
                     const std::string& index = indexOf({0})) {
  using Traits = sensor_msgs::NavSatFix;
  const auto header = [](std::size_t index_at) {
    return "#ROSBAG V2.0\n" + record({"op=\x03", "index_pos=" + number(index_at, 8), "conn_count=" + number(1, 4),
                                      "chunk_count=" + number(1, 4)},
                                     "");
  };
  const std::size_t chunk_at = header(0).size();
  const std::string body = record({"op=\x05", "compression=" + compression, "size=" + number(size, 4)}, packed) + index;
  std::string description;
  for (const std::string& field :
       {std::string("topic=/gps/fix"), std::string("type=") + ros::message_traits::datatype<Traits>(),
        std::string("md5sum=") + ros::message_traits::md5sum<Traits>(), std::string("message_definition=")}) {
    description += number(field.size(), 4) + field;
  }
  const std::string summary =
      record({"op=\x07", "conn=" + number(0, 4), "topic=/gps/fix"}, description) +
      record({"op=\x06", "ver=" + number(1, 4), "chunk_pos=" + number(chunk_at, 8), "start_time=" + number(0, 8),
              "end_time=" + number(0, 8), "count=" + number(1, 4)},
             number(0, 4) + number(1, 4));
  return header(chunk_at + body.size()) + body + summary;
}

std::string packedLz4(std::string content, int block_size) {
  std::string packed(content.size() + 1000, '\0');
  auto size = static_cast<unsigned int>(packed.size());
  EXPECT_EQ(roslz4_buffToBuffCompress(content.data(), static_cast<unsigned int>(content.size()), packed.data(), &size,
                                      block_size),
            ROSLZ4_OK);
  return packed.substr(0, size);
}

/// A bag whose chunk holds `content`, and one in which the chunk is compressed.
std::vector<std::string> plainAndPacked(const std::string& content, const std::string& index) {
  constexpr int kBlocksOf64Kib = 4;
  return {oneChunk("none", content.size(), content, index),
          oneChunk("lz4", content.size(), packedLz4(content, kBlocksOf64Kib), index)};
}

std::string messageOf(std::uint64_t connection, const std::string& data) {
  return record({"op=\x02", "conn=" + number(connection, 4), "time=" + number(0, 8)}, data);
}

TEST_F(BagFileTest, AMessageIndexedTwiceIsRefused) {
  const std::string message = messageOf(0, "");
  for (const std::string& bag : plainAndPacked(message + message, indexOf({0, message.size()}))) {
    EXPECT_EQ(refusal(writeBytes(bag)), "accepted");
  }
  for (const std::string& bag : plainAndPacked(message + message, indexOf({0, 0}))) {
    EXPECT_EQ(refusal(writeBytes(bag)), "an index points to a message twice");
  }
}

TEST_F(BagFileTest, AnIndexLongerThanItsChunkIsRefused) {
  const std::string message = messageOf(0, "");
  for (const std::string& bag : plainAndPacked(message, indexOf(std::vector<std::size_t>(1000)))) {
    EXPECT_EQ(refusal(writeBytes(bag)), "the indices of a chunk have more entries than it has messages");
  }
}

TEST_F(BagFileTest, DamageWithinAChunkIsRefused) {
  const std::string message = messageOf(0, "data");
  std::string long_data = message;
  long_data[message.size() - 5] = '\x7F';  // the length of the data
  std::string long_header = message;
  long_header[3] = '\x7F';
  struct {
    const char* text;
    std::string content;
    std::size_t offset;
  } const damages[] = {
      {"a record's data at byte", long_data, 0},
      {"a record's header at byte", long_header, 0},
      {"ends within a record's header", message + "no", 0},
      {"an index points beside its messages", message, 1},
      {"an index points beside its messages", message, message.size()},
      {"an index points beside its messages", message, 0xFFFFFFFF},
      {"an index points beside its messages", messageOf(1, "data"), 0},
      {"something else than messages", indexOf({0}), 0},
  };
  for (const auto& damage : damages) {
    for (const std::string& bag : plainAndPacked(damage.content, indexOf({damage.offset}))) {
      const std::string path = writeBytes(bag);
      EXPECT_THAT(refusal(path), HasSubstr(damage.text));
      EXPECT_EQ(signalWhileReading(path), 0) << damage.text;
    }
  }
}

TEST_F(BagFileTest, ReadsWhatWasWritten) {
  for (const std::string& bytes :
       plainAndPacked(messageOf(0, "one") + messageOf(0, "two"), indexOf({messageOf(0, "one").size(), 0}))) {
    BagFile bag(writeBytes(bytes));
    const std::vector<bag::Message> messages = bag.messages({0});
    ASSERT_EQ(messages.size(), 2U);
    EXPECT_EQ(bag.read(messages[0]), "two");  // of the same time: in the order of the index
    EXPECT_EQ(bag.read(messages[1]), "one");
    EXPECT_TRUE(bag.messages({1}).empty());
  }
}

TEST_F(BagFileTest, WhatCannotBeUnpackedIsRefused) {
  EXPECT_THAT(refusal(writeBytes(oneChunk("bz2", 100, "no such thing"))), HasSubstr("cannot be unpacked"));
  EXPECT_THAT(refusal(writeBytes(oneChunk("lz4", 100, "no such thing"))), HasSubstr("too long"));
  EXPECT_THAT(refusal(writeBytes(oneChunk("lz4", 100, std::string(20, '\0')))), HasSubstr("unknown block size"));
  EXPECT_THAT(refusal(writeBytes(oneChunk("lz4", 100, "short"))), HasSubstr("cut off"));
}

TEST_F(BagFileTest, ALz4BlockLargerThanItsFrameAllowsIsRefused) {
  const std::string content(100'000, 'x');
  constexpr int kBlocksOf64Kib = 4;
  const std::string packed = packedLz4(content, kBlocksOf64Kib);
  EXPECT_EQ(refusal(writeBytes(oneChunk("lz4", content.size(), packed))),
            "a record's header at byte 4 claims 2021161080 bytes of 99996");  // unpacked, but not made of records
  constexpr std::size_t kBlock = 900'000;                                     // would be copied into a buffer of 64 KiB
  const std::string frame = packed.substr(0, 7) + number(kBlock, 4) + std::string(kBlock, 'x') + number(0, 8);
  const std::string path = writeBytes(oneChunk("lz4", content.size(), frame));
  EXPECT_EQ(signalWhileReading(path), 0);
  EXPECT_EQ(refusal(path), "a block of a compressed chunk is too long");
}

TEST_F(BagFileTest, OtherVersionsAndFilesAreRefused) {
  std::string bytes = test::readAll(writeBag(rosbag::compression::Uncompressed));
  bytes[9] = '1';
  EXPECT_THROW(BagFile(writeBytes(bytes)), UnsupportedBag);
  EXPECT_THROW(BagFile(writeBytes("no bag at all")), UnsupportedBag);
}

TEST_F(BagFileTest, NoMutationKillsTheReader) {
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

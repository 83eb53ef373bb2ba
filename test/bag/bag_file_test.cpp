#include "bag/bag_file.h"

#include <functional>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/bag/written_bag.h"
#include "test/support/refusal.h"

namespace visual_localization {
namespace {

using bag::BagFile;
using bag::DamagedBag;
using bag::UnsupportedBag;
using rosbag::compression::CompressionType;
using test::BagFileTest;
using testing::HasSubstr;

const CompressionType kCompressions[] = {rosbag::compression::Uncompressed, rosbag::compression::BZ2,
                                         rosbag::compression::LZ4};

TEST_F(BagFileTest, AcceptsEveryCompression) {
  for (const CompressionType compression : kCompressions) {
    const std::string path = writeBag(compression);
    EXPECT_EQ(refusal(path), "accepted");
    EXPECT_EQ(BagReader(path).fixes("/gps/fix").size(), 12u);
  }
}

TEST_F(BagFileTest, OtherVersionsAndFilesAreRefused) {
  std::string bytes = test::readAll(writeBag(rosbag::compression::Uncompressed));
  bytes[9] = '1';
  EXPECT_THROW(BagFile(inMemory(bytes)), UnsupportedBag);
  EXPECT_THROW(BagFile(inMemory("no bag at all")), UnsupportedBag);
  for (const char* of_ros_2 : {"\x89MCAP0\r\nand so on", "SQLite format 3 and so on"}) {
    try {
      BagFile(inMemory(of_ros_2));
      FAIL() << of_ros_2;
    } catch (const UnsupportedBag& error) {
      EXPECT_NE(std::string(error.what()).find("rosbags-convert"), std::string::npos) << error.what();
    }
  }
}

TEST_F(BagFileTest, EveryCutIsRefused) {
  const std::string bytes = test::readAll(writeBag(rosbag::compression::Uncompressed));
  for (std::size_t size = 14; size < bytes.size(); size += 37) {
    EXPECT_THROW(BagFile(inMemory(bytes.substr(0, size))), DamagedBag) << size;
  }
}

TEST_F(BagFileTest, TheReaderNamesThePath) {
  std::string bytes = test::readAll(writeBag(rosbag::compression::Uncompressed));
  bytes[13] = '\xFF';  // the length of the first header
  const std::string path = writeBytes(bytes);
  const std::string refusal = test::refusalOf<BagError>([&] { const BagReader bag(path); });
  EXPECT_THAT(refusal, testing::StartsWith(path));
  EXPECT_THAT(refusal, HasSubstr("damaged"));
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

/// From `after` the first `pattern` to the same place of the last one.
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
      {"it ends before its index", patch("index_pos=", 10, huge + huge)},
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
    EXPECT_THAT(test::refusalOf<BagError>([&] { const BagReader bag(path); }),
                testing::AllOf(testing::StartsWith(path), HasSubstr(damage.text)));
  }
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

// Chunks made byte by byte: their indices, their messages and their compression.

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <bzlib.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <roslz4/lz4s.h>
#include <sensor_msgs/NavSatFix.h>

#include "test/bag/written_bag.h"

namespace visual_localization {
namespace {

using bag::BagFile;
using test::BagFileTest;
using testing::HasSubstr;

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

std::string indexOf(const std::vector<std::size_t>& offsets) {
  std::string entries;
  for (const std::size_t offset : offsets) entries += number(0, 8) + number(offset, 4);
  return record({"op=\x04", "ver=" + number(1, 4), "conn=" + number(0, 4), "count=" + number(offsets.size(), 4)},
                entries);
}

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

std::string packedBz2(std::string content) {
  std::string packed(content.size() + 1000, '\0');
  auto size = static_cast<unsigned int>(packed.size());
  EXPECT_EQ(BZ2_bzBuffToBuffCompress(packed.data(), &size, content.data(), static_cast<unsigned int>(content.size()), 9,
                                     0, 0),
            BZ_OK);
  return packed.substr(0, size);
}

constexpr int kBlocksOf64Kib = 4;

/// A bag whose chunk holds `content`, and those in which the chunk is compressed.
std::vector<std::string> plainAndPacked(const std::string& content, const std::string& index) {
  return {oneChunk("none", content.size(), content, index),
          oneChunk("lz4", content.size(), packedLz4(content, kBlocksOf64Kib), index),
          oneChunk("bz2", content.size(), packedBz2(content), index)};
}

std::string messageOf(std::uint64_t connection, const std::string& data) {
  return record({"op=\x02", "conn=" + number(connection, 4), "time=" + number(0, 8)}, data);
}

TEST_F(BagFileTest, ReadsWhatWasWritten) {
  for (const std::string& bytes :
       plainAndPacked(messageOf(0, "one") + messageOf(0, "two"), indexOf({messageOf(0, "one").size(), 0}))) {
    BagFile bag(inMemory(bytes));
    const std::vector<bag::Message> messages = bag.messages({0});
    ASSERT_EQ(messages.size(), 2U);
    EXPECT_EQ(bag.read(messages[0]), "two");  // of the same time: in the order of the index
    EXPECT_EQ(bag.read(messages[1]), "one");
    EXPECT_TRUE(bag.messages({1}).empty());
  }
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

TEST_F(BagFileTest, WhatCannotBeUnpackedIsRefused) {
  EXPECT_THAT(refusal(writeBytes(oneChunk("bz2", 100, "no such thing"))), HasSubstr("cannot be unpacked"));
  EXPECT_THAT(refusal(writeBytes(oneChunk("lz4", 100, "no such thing"))), HasSubstr("too long"));
  EXPECT_THAT(refusal(writeBytes(oneChunk("lz4", 100, std::string(20, '\0')))), HasSubstr("unknown block size"));
  EXPECT_THAT(refusal(writeBytes(oneChunk("lz4", 100, "short"))), HasSubstr("cut off"));
}

TEST_F(BagFileTest, AChunkOfSeveralMegabytesIsUnpacked) {
  const std::string data(5'000'000, 'x');
  for (const std::string& bytes : plainAndPacked(messageOf(0, data), indexOf({0}))) {
    BagFile bag(inMemory(bytes));
    EXPECT_EQ(bag.read(bag.messages({0}).at(0)), data);
  }
}

/// A bag of few bytes must not take memory by what it claims.
TEST_F(BagFileTest, AChunkThatClaimsMoreThanItHoldsTakesNoMemory) {
  constexpr std::size_t kClaimed = 1U << 28U;
  constexpr std::size_t kEnough = 1U << 26U;
  const std::string message = messageOf(0, "data");
  for (const std::size_t claimed : {message.size() - 1, message.size() + 1, kClaimed}) {
    for (const std::string& bag :
         {oneChunk("lz4", claimed, packedLz4(message, kBlocksOf64Kib)), oneChunk("bz2", claimed, packedBz2(message))}) {
      const std::string path = writeBytes(bag);
      const auto refuse = [&path] {
        limitMemory(kEnough);
        std::cerr << refusal(path);
        std::exit(0);
      };
      EXPECT_EXIT(refuse(), testing::ExitedWithCode(0), "not to the size that it claims") << claimed;
    }
  }
}

TEST_F(BagFileTest, ALz4BlockLargerThanItsFrameAllowsIsRefused) {
  const std::string content(100'000, 'x');
  const std::string packed = packedLz4(content, kBlocksOf64Kib);
  EXPECT_EQ(refusal(writeBytes(oneChunk("lz4", content.size(), packed))),
            "a record's header at byte 4 claims 2021161080 bytes of 99996");  // unpacked, but not made of records
  constexpr std::size_t kBlock = 900'000;                                     // would be copied into a buffer of 64 KiB
  const std::string frame = packed.substr(0, 7) + number(kBlock, 4) + std::string(kBlock, 'x') + number(0, 8);
  const std::string path = writeBytes(oneChunk("lz4", content.size(), frame));
  EXPECT_EQ(signalWhileReading(path), 0);
  EXPECT_EQ(refusal(path), "a block of a compressed chunk is too long");
}

/// Counts what is read of a bag.
class CountedBytes : public bag::Bytes {
 public:
  CountedBytes(const std::string& path, std::uint64_t& read) : file_(path), read_(read) {}
  std::uint64_t size() const override { return file_.size(); }
  void read(std::uint64_t offset, std::size_t count, char* to) const override {
    read_ += count;
    file_.read(offset, count, to);
  }

 private:
  bag::FileBytes file_;
  std::uint64_t& read_;
};

void readAll(BagFile& bag) {
  for (const bag::Message& message : bag.messages({0})) bag.read(message);
}

TEST_F(BagFileTest, AShortRecordingIsUnpackedOnce) {
  std::uint64_t read = 0;
  BagFile bag(std::make_unique<CountedBytes>(writeLargeMessages(4), read));
  readAll(bag);
  const std::uint64_t once = read;
  readAll(bag);
  EXPECT_EQ(read, once);
}

TEST_F(BagFileTest, NotMoreChunksAreKeptThanAllowed) {
  std::uint64_t read = 0;
  BagFile bag(std::make_unique<CountedBytes>(writeLargeMessages(40), read));
  std::uint64_t most = 0;
  for (const bag::Message& message : bag.messages({0})) {
    bag.read(message);
    most = std::max(most, bag.unpackedBytes());
  }
  EXPECT_LE(most, BagFile::kMostUnpacked);
  EXPECT_GT(most, BagFile::kMostUnpacked / 2);
  const std::uint64_t once = read;
  readAll(bag);
  EXPECT_GT(read, once);
}

}  // namespace
}  // namespace visual_localization

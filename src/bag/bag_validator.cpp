#include "bag/bag_validator.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <string_view>
#include <vector>

#include <bzlib.h>
#include <roslz4/lz4s.h>

#include "bag/bag_record.h"

namespace visual_localization {
namespace {

using bag::Bytes;
using bag::Fields;
using bag::Op;
using bag::Range;
using bag::Record;

constexpr std::string_view kVersion = "#ROSBAG V2.0\n";
constexpr std::uint64_t kLargestChunk = 1U << 28U;  ///< bytes, unpacked; recorders make chunks below 1 MB by default

void require(bool condition, const char* otherwise) {
  if (!condition) throw DamagedBag(otherwise);
}

std::string field(const Fields& fields, const char* name) {
  const auto found = fields.find(name);
  if (found == fields.end()) throw DamagedBag(std::string("a record has no field '") + name + "'");
  return found->second;
}

/// Connections by their number: what a message may refer to.
using Connections = std::set<std::uint64_t>;

std::uint64_t checkConnection(const Bytes& bytes, const Record& record) {
  field(record.fields, "topic");
  const Fields description =
      bag::readFields(bag::readRange(bytes, record.data, bag::kLongestHeader, "a connection's description"));
  for (const char* name : {"type", "md5sum", "message_definition"}) field(description, name);
  return bag::number(record.fields, "conn", 4);
}

/// roslz4 copies a block into a buffer of the size that the frame's header announces, whatever the block's own size.
void requireLz4Blocks(std::string_view frame) {
  constexpr std::size_t kHeader = 7;
  constexpr std::size_t kWord = 4;
  require(frame.size() > kHeader, "a compressed chunk is cut off");
  const unsigned int size_id = static_cast<unsigned char>(frame[5]) >> 4U;
  require(size_id >= 4 && size_id <= 7, "a compressed chunk has an unknown block size");
  const std::uint64_t largest = 1U << (8U + 2U * size_id);
  for (frame.remove_prefix(kHeader);;) {
    require(frame.size() >= kWord, "a compressed chunk is cut off");
    const std::uint64_t size = bag::numberAt(frame, 0, kWord) & 0x7FFFFFFFU;  // the highest bit says: not compressed
    frame.remove_prefix(kWord);
    if (size == 0) break;
    require(size <= largest && size <= frame.size(), "a block of a compressed chunk is too long");
    frame.remove_prefix(static_cast<std::size_t>(size));
  }
  require(frame.size() == kWord, "a compressed chunk does not end with its checksum");
}

bool unpacksLz4(std::string& packed, std::string& unpacked) {
  requireLz4Blocks(packed);
  auto size = static_cast<unsigned int>(unpacked.size());
  return roslz4_buffToBuffDecompress(packed.data(), static_cast<unsigned int>(packed.size()), unpacked.data(), &size) ==
             ROSLZ4_OK &&
         size == unpacked.size();
}

bool unpacksBz2(std::string& packed, std::string& unpacked) {
  auto size = static_cast<unsigned int>(unpacked.size());
  return BZ2_bzBuffToBuffDecompress(unpacked.data(), &size, packed.data(), static_cast<unsigned int>(packed.size()), 0,
                                    0) == BZ_OK &&
         size == unpacked.size();
}

std::string unpack(const Bytes& bytes, const Record& chunk, const std::string& compression, std::uint64_t size) {
  require(compression == "bz2" || compression == "lz4", "a chunk has an unknown compression");
  std::string packed = bag::readRange(bytes, chunk.data, kLargestChunk, "a chunk");
  std::string unpacked(static_cast<std::size_t>(size), '\0');
  require(compression == "bz2" ? unpacksBz2(packed, unpacked) : unpacksLz4(packed, unpacked),
          "a compressed chunk cannot be unpacked, or not to the size that it claims");
  return unpacked;
}

/// A message in a chunk.
struct Message {
  std::uint32_t offset = 0;
  std::uint32_t connection = 0;
  bool indexed = false;
};

/// In the order of their offsets.
using Messages = std::vector<Message>;

/// What rosbag finds from an offset: it steps over connections until it meets a message.
Messages messagesIn(const Bytes& bytes, Range range) {
  Messages messages;
  const std::uint64_t begin = range.begin;
  while (range.begin < range.end) {
    const Record record = bag::readRecord(bytes, range);
    if (record.op == Op::kConnection) {
      checkConnection(bytes, record);
    } else {
      require(record.op == Op::kMessage, "a chunk holds something else than messages and connections");
      bag::number(record.fields, "time", 8);
      messages.push_back({static_cast<std::uint32_t>(range.begin - begin),
                          static_cast<std::uint32_t>(bag::number(record.fields, "conn", 4))});
    }
    range.begin = record.data.end;
  }
  return messages;
}

Messages checkChunk(const Bytes& bytes, const Record& chunk) {
  const std::string compression = field(chunk.fields, "compression");
  const std::uint64_t size = bag::number(chunk.fields, "size", 4);
  if (size > kLargestChunk) {
    throw DamagedBag("a chunk claims " + std::to_string(size) + " bytes, at most " + std::to_string(kLargestChunk) +
                     " are accepted");
  }
  if (compression == "none") {
    require(chunk.data.size() == size, "a chunk has another size than it claims");
    return messagesIn(bytes, chunk.data);
  }
  const bag::MemoryBytes unpacked(unpack(bytes, chunk, compression, size));
  return messagesIn(unpacked, {0, size});
}

/// Returns the connection that the index is of. Each message is indexed once at most: otherwise a small bag could
/// claim any number of messages.
std::uint64_t checkIndex(const Bytes& bytes, const Record& index, Messages& messages) {
  constexpr std::size_t kEntry = 12;  // stamp and offset
  require(bag::number(index.fields, "ver", 4) == 1, "an index has an unknown version");
  const std::uint64_t connection = bag::number(index.fields, "conn", 4);
  require(bag::number(index.fields, "count", 4) * kEntry == index.data.size(), "an index has the wrong size");
  const std::string entries = bag::readRange(bytes, index.data, messages.size() * kEntry, "an index");
  for (std::size_t at = 0; at < entries.size(); at += kEntry) {
    const std::uint64_t offset = bag::numberAt(entries, at + 8, 4);
    const auto message = std::lower_bound(messages.begin(), messages.end(), offset,
                                          [](const Message& one, std::uint64_t other) { return one.offset < other; });
    require(message != messages.end() && message->offset == offset && message->connection == connection,
            "an index points beside its messages");
    require(!message->indexed, "an index points to a message twice");
    message->indexed = true;
  }
  return connection;
}

/// A chunk with the indices behind it.
struct IndexedChunk {
  std::size_t indices = 0;
  Connections connections;
  bool described = false;
};

class Validator {
 public:
  explicit Validator(const Bytes& bytes) : bytes_(bytes) {}

  void run() {
    const Record header = bag::readRecord(bytes_, {kVersion.size(), bytes_.size()});
    require(header.op == Op::kBagHeader, "does not begin with a bag header");
    const auto encryptor = header.fields.find("encryptor");
    if (encryptor != header.fields.end() && !encryptor->second.empty()) throw UnsupportedBag("bag is encrypted");
    const std::uint64_t index_at = bag::number(header.fields, "index_pos", 8);
    if (index_at == 0) {
      throw UnsupportedBag("bag is not indexed, as after an interrupted recording; `rosbag reindex` may repair it");
    }
    require(index_at >= header.data.end && index_at <= bytes_.size(), "the index lies outside the file");
    readChunks({header.data.end, index_at});
    readSummary(header, {index_at, bytes_.size()});
  }

 private:
  /// Everything between the header and the summary: chunks, each followed by its indices.
  void readChunks(Range range) {
    Messages messages;
    IndexedChunk* chunk = nullptr;
    while (range.begin < range.end) {
      const Record record = bag::readRecord(bytes_, range);
      if (record.op == Op::kChunk) {
        messages = checkChunk(bytes_, record);
        chunk = &chunks_[range.begin];
      } else {
        require(record.op == Op::kIndex && chunk != nullptr, "a record stands where a chunk or an index should");
        chunk->connections.insert(checkIndex(bytes_, record, messages));
        ++chunk->indices;
      }
      range.begin = record.data.end;
    }
  }

  /// Connections and descriptions of chunks at the end, as many as the header says.
  void readSummary(const Record& header, Range range) {
    const std::uint64_t connections = bag::number(header.fields, "conn_count", 4);
    const std::uint64_t chunks = bag::number(header.fields, "chunk_count", 4);
    for (std::uint64_t i = 0; i < connections; ++i) {
      const Record record = bag::readRecord(bytes_, range);
      require(record.op == Op::kConnection, "the summary lacks a connection");
      connections_.insert(checkConnection(bytes_, record));
      range.begin = record.data.end;
    }
    for (std::uint64_t i = 0; i < chunks; ++i) {
      const Record record = bag::readRecord(bytes_, range);
      require(record.op == Op::kChunkInfo, "the summary lacks the description of a chunk");
      checkChunkInfo(record);
      range.begin = record.data.end;
    }
  }

  void checkChunkInfo(const Record& info) {
    constexpr std::size_t kEntry = 8;  // connection and count
    require(bag::number(info.fields, "ver", 4) == 1, "a chunk's description has an unknown version");
    bag::number(info.fields, "start_time", 8);
    bag::number(info.fields, "end_time", 8);
    const std::uint64_t count = bag::number(info.fields, "count", 4);
    require(count * kEntry == info.data.size(), "a chunk's description has the wrong size");
    const auto found = chunks_.find(bag::number(info.fields, "chunk_pos", 8));
    require(found != chunks_.end(), "a chunk's description points beside it");
    IndexedChunk& chunk = found->second;
    require(!chunk.described, "a chunk is described twice");
    chunk.described = true;
    require(count <= chunk.indices, "a chunk has fewer indices than its description says");
    require(std::includes(connections_.begin(), connections_.end(), chunk.connections.begin(), chunk.connections.end()),
            "a chunk has messages of an unknown connection");
  }

  const Bytes& bytes_;
  std::map<std::uint64_t, IndexedChunk> chunks_;
  Connections connections_;
};

void requireVersion(const Bytes& bytes) {
  const Range start{0, std::min<std::uint64_t>(bytes.size(), kVersion.size())};
  const std::string version = bag::readRange(bytes, start, kVersion.size(), "the version");
  if (version.substr(0, 8) != kVersion.substr(0, 8)) throw UnsupportedBag("is not a bag");
  if (version != kVersion) throw UnsupportedBag("is a bag of another format than 2.0");
}

}  // namespace

void validateBag(const std::string& path) {
  const bag::FileBytes bytes(path);
  requireVersion(bytes);
  Validator(bytes).run();
}

}  // namespace visual_localization

#include "bag/bag_file.h"

#include <algorithm>
#include <cstddef>
#include <new>
#include <utility>

#include <bzlib.h>
#include <roslz4/lz4s.h>

namespace visual_localization::bag {
namespace {

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

std::uint32_t word(const Fields& fields, const char* name) {
  return static_cast<std::uint32_t>(number(fields, name, 4));
}

void requireVersion(const Bytes& bytes) {
  const Range start{0, std::min<std::uint64_t>(bytes.size(), kVersion.size())};
  const std::string version = readRange(bytes, start, kVersion.size(), "the version");
  constexpr const char* kConvert =
      ": rosbags-convert --src FOLDER --dst NAME.bag converts the folder of it (pip install rosbags)";
  if (version.substr(1, 4) == "MCAP") throw UnsupportedBag(std::string("is a bag of ROS 2, MCAP") + kConvert);
  if (version == "SQLite format")
    throw UnsupportedBag(std::string("is SQLite, as a map or a .db3 of ROS 2") + kConvert);
  if (version.substr(0, 8) != kVersion.substr(0, 8)) throw UnsupportedBag("is not a bag");
  if (version != kVersion) throw UnsupportedBag("is a bag of another format than 2.0");
}

Connection readConnection(const Bytes& bytes, const Record& record) {
  const std::string topic = field(record.fields, "topic");
  const Fields description = readFields(readRange(bytes, record.data, kLongestHeader, "a connection's description"));
  field(description, "message_definition");
  return {topic, field(description, "type"), field(description, "md5sum")};
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

bool unpacksLz4(std::string& packed, std::size_t size, std::string& unpacked) {
  constexpr std::size_t kMostOfOne = 255;  // bytes that a byte may stand for
  requireLz4Blocks(packed);
  if (size / kMostOfOne > packed.size()) return false;
  unpacked.resize(size);
  auto count = static_cast<unsigned int>(size);
  const int result =
      roslz4_buffToBuffDecompress(packed.data(), static_cast<unsigned int>(packed.size()), unpacked.data(), &count);
  if (result == ROSLZ4_MEMORY_ERROR) throw std::bad_alloc();
  return result == ROSLZ4_OK && count == size;
}

/// A few bytes may stand for any number, so memory follows what is there, not what is claimed.
bool unpacksBz2(std::string& packed, std::size_t size, std::string& unpacked) {
  constexpr std::size_t kFirst = 1U << 20U;
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) throw std::bad_alloc();  // nothing else can fail there
  const std::unique_ptr<bz_stream, decltype(&BZ2_bzDecompressEnd)> ended(&stream, BZ2_bzDecompressEnd);
  stream.next_in = packed.data();
  stream.avail_in = static_cast<unsigned int>(packed.size());
  int result = BZ_OK;
  do {
    const std::size_t begin = unpacked.size();
    if (begin > 0) unpacked.reserve(size);  // so that nothing is copied as it grows
    unpacked.resize(std::min(size, std::max(kFirst, 2 * begin)));
    stream.next_out = unpacked.data() + begin;
    stream.avail_out = static_cast<unsigned int>(unpacked.size() - begin);
    result = BZ2_bzDecompress(&stream);
  } while (result == BZ_OK && stream.avail_out == 0 && unpacked.size() < size);
  if (result == BZ_MEM_ERROR) throw std::bad_alloc();
  return result == BZ_STREAM_END && stream.avail_out == 0 && unpacked.size() == size;
}

std::string unpack(const Bytes& bytes, Range chunk, const std::string& compression, std::uint64_t size) {
  std::string packed = readRange(bytes, chunk, kLargestChunk, "a chunk");
  std::string unpacked;
  require((compression == "bz2" ? unpacksBz2 : unpacksLz4)(packed, static_cast<std::size_t>(size), unpacked),
          "a compressed chunk cannot be unpacked, or not to the size that it claims");
  return unpacked;
}

/// A message's record in a chunk.
struct FoundMessage {
  std::uint64_t offset = 0;
  std::uint32_t connection = 0;
  bool indexed = false;
};

/// In the order of their offsets. Throws unless the chunk holds nothing but messages and connections.
std::vector<FoundMessage> findMessages(const Bytes& bytes, Range range) {
  std::vector<FoundMessage> found;
  const std::uint64_t begin = range.begin;
  while (range.begin < range.end) {
    const Record record = readRecord(bytes, range);
    if (record.op == Op::kConnection) {
      readConnection(bytes, record);
    } else {
      require(record.op == Op::kMessage, "a chunk holds something else than messages and connections");
      number(record.fields, "time", 8);
      found.push_back({range.begin - begin, word(record.fields, "conn")});
    }
    range.begin = record.data.end;
  }
  return found;
}

}  // namespace

BagFile::BagFile(std::unique_ptr<const Bytes> bytes) : file_(std::move(bytes)) {
  requireVersion(*file_);
  const Record header = readRecord(*file_, {kVersion.size(), file_->size()});
  require(header.op == Op::kBagHeader, "does not begin with a bag header");
  const auto encryptor = header.fields.find("encryptor");
  if (encryptor != header.fields.end() && !encryptor->second.empty()) throw UnsupportedBag("bag is encrypted");
  const std::uint64_t index_at = number(header.fields, "index_pos", 8);
  if (index_at == 0) {
    throw UnsupportedBag("bag is not indexed, as after an interrupted recording; `rosbag reindex` may repair it");
  }
  require(index_at >= header.data.end, "the index lies in the header");
  require(index_at <= file_->size(),
          "it ends before its index, as a copy that was cut off; `rosbag reindex` may repair it");
  readChunks({header.data.end, index_at});
  readSummary(header, {index_at, file_->size()});
}

/// Chunks, each followed by its indices, between header and summary.
void BagFile::readChunks(Range range) {
  Chunk* chunk = nullptr;
  std::uint64_t chunk_at = 0;
  while (range.begin < range.end) {
    const Record record = readRecord(*file_, range);
    if (record.op == Op::kChunk) {
      chunk_at = range.begin;
      chunk = &chunks_[chunk_at];
      chunk->data = record.data;
      chunk->compression = field(record.fields, "compression");
      chunk->size = number(record.fields, "size", 4);
      requireChunk(*chunk);
    } else if (record.op == Op::kConnection || record.op == Op::kChunkInfo) {
      chunk = nullptr;  // an older summary: see BagWriter
    } else {
      require(record.op == Op::kIndex && chunk != nullptr, "a record stands where a chunk or an index should");
      readIndex(record, chunk_at, *chunk);
    }
    range.begin = record.data.end;
  }
  for (const auto& [at, uncompressed] : chunks_) {
    if (uncompressed.compression == "none") checkMessages(*file_, uncompressed.data, uncompressed);
  }
}

void BagFile::requireChunk(const Chunk& chunk) {
  if (chunk.size > kLargestChunk) {
    throw DamagedBag("a chunk claims " + std::to_string(chunk.size) + " bytes, at most " +
                     std::to_string(kLargestChunk) + " are accepted");
  }
  if (chunk.compression == "none") {
    require(chunk.data.size() == chunk.size, "a chunk has another size than it claims");
  } else {
    require(chunk.compression == "bz2" || chunk.compression == "lz4", "a chunk has an unknown compression");
  }
}

void BagFile::readIndex(const Record& record, std::uint64_t chunk_at, Chunk& chunk) const {
  constexpr std::size_t kEntry = 12;  // stamp and offset
  require(number(record.fields, "ver", 4) == 1, "an index has an unknown version");
  const std::uint32_t connection = word(record.fields, "conn");
  require(number(record.fields, "count", 4) * kEntry == record.data.size(), "an index has the wrong size");
  // A message's record is longer than its entry, and has one entry.
  require(record.data.size() <= chunk.size - chunk.index_bytes,
          "the indices of a chunk have more entries than it has messages");
  chunk.index_bytes += record.data.size();
  const std::string entries = readRange(*file_, record.data, chunk.size, "an index");
  std::vector<Message>& index = chunk.indices.emplace_back();
  index.reserve(entries.size() / kEntry);
  for (std::size_t at = 0; at < entries.size(); at += kEntry) {
    const auto seconds = static_cast<std::int64_t>(numberAt(entries, at, 4));
    const auto nanoseconds = static_cast<std::int64_t>(numberAt(entries, at + 4, 4));
    index.push_back({seconds * 1'000'000'000 + nanoseconds, chunk_at,
                     static_cast<std::uint32_t>(numberAt(entries, at + 8, 4)), connection});
  }
}

/// At the end, as many as the header says.
void BagFile::readSummary(const Record& header, Range range) {
  const std::uint64_t connections = number(header.fields, "conn_count", 4);
  const std::uint64_t chunks = number(header.fields, "chunk_count", 4);
  for (std::uint64_t i = 0; i < connections; ++i) {
    const Record record = readRecord(*file_, range);
    require(record.op == Op::kConnection, "the summary lacks a connection");
    connections_.emplace(word(record.fields, "conn"), readConnection(*file_, record));
    range.begin = record.data.end;
  }
  for (std::uint64_t i = 0; i < chunks; ++i) {
    const Record record = readRecord(*file_, range);
    require(record.op == Op::kChunkInfo, "the summary lacks the description of a chunk");
    readChunkInfo(record);
    range.begin = record.data.end;
  }
}

void BagFile::readChunkInfo(const Record& info) {
  constexpr std::size_t kEntry = 8;  // connection and count
  require(number(info.fields, "ver", 4) == 1, "a chunk's description has an unknown version");
  number(info.fields, "start_time", 8);
  number(info.fields, "end_time", 8);
  const std::uint64_t count = number(info.fields, "count", 4);
  require(count * kEntry == info.data.size(), "a chunk's description has the wrong size");
  const auto found = chunks_.find(number(info.fields, "chunk_pos", 8));
  require(found != chunks_.end(), "a chunk's description points beside it");
  Chunk& chunk = found->second;
  require(!chunk.described, "a chunk is described twice");
  chunk.described = true;
  require(count <= chunk.indices.size(), "a chunk has fewer indices than its description says");
  for (const std::vector<Message>& index : chunk.indices) {
    require(index.empty() || connections_.count(index.front().connection) != 0,
            "a chunk has messages of an unknown connection");
  }
  chunk.indices.resize(static_cast<std::size_t>(count));  // the description decides what counts
}

/// Each message is indexed once at most: otherwise a small bag could claim any number of messages.
void BagFile::checkMessages(const Bytes& bytes, Range range, const Chunk& chunk) {
  std::vector<FoundMessage> found = findMessages(bytes, range);
  for (const std::vector<Message>& index : chunk.indices) {
    for (const Message& entry : index) {
      const auto message =
          std::lower_bound(found.begin(), found.end(), entry.offset,
                           [](const FoundMessage& one, std::uint32_t offset) { return one.offset < offset; });
      require(message != found.end() && message->offset == entry.offset && message->connection == entry.connection,
              "an index points beside its messages");
      require(!message->indexed, "an index points to a message twice");
      message->indexed = true;
    }
  }
}

std::vector<Message> BagFile::messages(const std::set<std::uint32_t>& connections) const {
  std::vector<Message> messages;
  for (const auto& [at, chunk] : chunks_) {
    if (!chunk.described) continue;
    for (const std::vector<Message>& index : chunk.indices) {
      if (!index.empty() && connections.count(index.front().connection) != 0) {
        messages.insert(messages.end(), index.begin(), index.end());
      }
    }
  }
  std::stable_sort(messages.begin(), messages.end(),
                   [](const Message& one, const Message& other) { return one.stamp_ns < other.stamp_ns; });
  return messages;
}

/// The content of a compressed chunk, checked.
const MemoryBytes& BagFile::unpacked(std::uint64_t at, const Chunk& chunk) {
  const auto found = unpacked_.find(at);
  if (found != unpacked_.end()) return *found->second;
  if (unpacked_bytes_ + chunk.size > kMostUnpacked) {
    unpacked_.clear();
    unpacked_bytes_ = 0;
  }
  auto content = std::make_unique<MemoryBytes>(unpack(*file_, chunk.data, chunk.compression, chunk.size));
  checkMessages(*content, {0, chunk.size}, chunk);
  unpacked_bytes_ += chunk.size;
  return *unpacked_.emplace(at, std::move(content)).first->second;
}

std::string BagFile::read(const Message& message) {
  const Chunk& chunk = chunks_.at(message.chunk);
  const bool is_packed = chunk.compression != "none";
  const Bytes& bytes = is_packed ? static_cast<const Bytes&>(unpacked(message.chunk, chunk)) : *file_;
  const Range range = is_packed ? Range{0, chunk.size} : chunk.data;
  require(message.offset < range.size(), "an index points beside its messages");
  const Record record = readRecord(bytes, {range.begin + message.offset, range.end});
  return readRange(bytes, record.data, kLargestChunk, "a message");
}

}  // namespace visual_localization::bag

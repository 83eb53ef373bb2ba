#include "visual_localization/ros/bag_validator.h"

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string_view>
#include <vector>

#include <boost/interprocess/file_mapping.hpp>
#include <boost/interprocess/mapped_region.hpp>
#include <bzlib.h>
#include <roslz4/lz4s.h>

#include "bag_record.h"

namespace visual_localization {
namespace {

using bag::Fields;
using bag::Op;
using bag::Record;

constexpr std::string_view kVersion = "#ROSBAG V2.0\n";
constexpr std::uint64_t kLargestChunk = 1U << 28U;  ///< bytes, unpacked; recorders make chunks below 1 MB by default

void require(bool condition, const std::string& otherwise) {
  if (!condition) throw DamagedBag(otherwise);
}

void requireField(const Fields& fields, const char* name) {
  require(fields.count(name) != 0, std::string("a record has no field '") + name + "'");
}

std::string_view field(const Fields& fields, const char* name) {
  requireField(fields, name);
  return fields.at(name);
}

/// Connections by their number: what a message may refer to.
using Connections = std::set<std::uint64_t>;

std::uint64_t checkConnection(const Record& record) {
  requireField(record.fields, "topic");
  const Fields description = bag::readFields(record.data);
  for (const char* name : {"type", "md5sum", "message_definition"}) requireField(description, name);
  return bag::number(record.fields, "conn", 4);
}

/// Unpacks a chunk into `buffer` unless it is stored as it is.
std::string_view unpacked(const Record& chunk, std::vector<char>& buffer) {
  const std::string_view compression = field(chunk.fields, "compression");
  const std::uint64_t size = bag::number(chunk.fields, "size", 4);
  require(size <= kLargestChunk, "a chunk claims " + std::to_string(size) + " bytes, at most " +
                                     std::to_string(kLargestChunk) + " are accepted");
  if (compression == "none") {
    require(chunk.data.size() == size, "a chunk has another size than it claims");
    return chunk.data;
  }
  buffer.resize(static_cast<std::size_t>(size));
  auto unpacked_size = static_cast<unsigned int>(size);
  // Both libraries take the input by a pointer that is not const, and leave it alone.
  char* input = const_cast<char*>(chunk.data.data());  // NOLINT(cppcoreguidelines-pro-type-const-cast)
  const auto input_size = static_cast<unsigned int>(chunk.data.size());
  bool unpacks = false;
  if (compression == "bz2") {
    unpacks = BZ2_bzBuffToBuffDecompress(buffer.data(), &unpacked_size, input, input_size, 0, 0) == BZ_OK;
  } else if (compression == "lz4") {
    unpacks = roslz4_buffToBuffDecompress(input, input_size, buffer.data(), &unpacked_size) == ROSLZ4_OK;
  } else {
    throw DamagedBag("a chunk has an unknown compression");
  }
  require(unpacks && unpacked_size == size, "a compressed chunk cannot be unpacked");
  return {buffer.data(), buffer.size()};
}

/// Offsets of the messages in a chunk with the number of their connection.
using Messages = std::map<std::uint64_t, std::uint64_t>;

/// What rosbag finds from an offset: it steps over connections until it meets a message.
Messages checkChunk(const Record& chunk) {
  std::vector<char> buffer;
  const std::string_view bytes = unpacked(chunk, buffer);
  Messages messages;
  for (std::size_t offset = 0; offset < bytes.size();) {
    const Record record = bag::readRecord(bytes, offset);
    if (record.op == Op::kConnection) {
      checkConnection(record);
    } else {
      require(record.op == Op::kMessage, "a chunk holds something else than messages and connections");
      bag::number(record.fields, "time", 8);
      messages[offset] = bag::number(record.fields, "conn", 4);
    }
    offset = record.end;
  }
  return messages;
}

/// Returns the connection that the index is of.
std::uint64_t checkIndex(const Record& index, const Messages& messages) {
  constexpr std::size_t kEntry = 12;  // stamp and offset
  require(bag::number(index.fields, "ver", 4) == 1, "an index has an unknown version");
  const std::uint64_t connection = bag::number(index.fields, "conn", 4);
  require(bag::number(index.fields, "count", 4) * kEntry == index.data.size(), "an index has the wrong size");
  for (std::size_t at = 0; at < index.data.size(); at += kEntry) {
    const auto message = messages.find(bag::numberAt(index.data, at + 8, 4));
    require(message != messages.end() && message->second == connection, "an index points beside its messages");
  }
  return connection;
}

/// A chunk with the indices behind it.
struct IndexedChunk {
  std::size_t indices = 0;
  Connections connections;
};

class Validator {
 public:
  explicit Validator(std::string_view bytes) : bytes_(bytes) {}

  void run() {
    const Record header = bag::readRecord(bytes_, kVersion.size());
    require(header.op == Op::kBagHeader, "does not begin with a bag header");
    const auto encryptor = header.fields.find("encryptor");
    require(encryptor == header.fields.end() || encryptor->second.empty(), "is encrypted");
    const std::uint64_t index_at = bag::number(header.fields, "index_pos", 8);
    if (index_at == 0) {
      throw DamagedBag("is not indexed, as after an interrupted recording; `rosbag reindex` may repair it");
    }
    require(index_at >= header.end && index_at <= bytes_.size(), "the index lies outside the file");
    readChunks(header.end, static_cast<std::size_t>(index_at));
    readSummary(header, static_cast<std::size_t>(index_at));
  }

 private:
  /// Everything between the header and the summary: chunks, each followed by its indices.
  void readChunks(std::size_t offset, std::size_t end) {
    Messages messages;
    IndexedChunk* chunk = nullptr;
    while (offset < end) {
      const Record record = bag::readRecord(bytes_.substr(0, end), offset);
      if (record.op == Op::kChunk) {
        messages = checkChunk(record);
        chunk = &chunks_[offset];
      } else {
        require(record.op == Op::kIndex && chunk != nullptr, "a record stands where a chunk or an index should");
        chunk->connections.insert(checkIndex(record, messages));
        ++chunk->indices;
      }
      offset = record.end;
    }
  }

  /// Connections and descriptions of chunks at the end, as many as the header says.
  void readSummary(const Record& header, std::size_t offset) {
    const std::uint64_t connections = bag::number(header.fields, "conn_count", 4);
    const std::uint64_t chunks = bag::number(header.fields, "chunk_count", 4);
    for (std::uint64_t i = 0; i < connections; ++i) {
      const Record record = bag::readRecord(bytes_, offset);
      require(record.op == Op::kConnection, "the summary lacks a connection");
      connections_.insert(checkConnection(record));
      offset = record.end;
    }
    for (std::uint64_t i = 0; i < chunks; ++i) {
      const Record record = bag::readRecord(bytes_, offset);
      require(record.op == Op::kChunkInfo, "the summary lacks the description of a chunk");
      checkChunkInfo(record);
      offset = record.end;
    }
  }

  void checkChunkInfo(const Record& info) const {
    constexpr std::size_t kEntry = 8;  // connection and count
    require(bag::number(info.fields, "ver", 4) == 1, "a chunk's description has an unknown version");
    bag::number(info.fields, "start_time", 8);
    bag::number(info.fields, "end_time", 8);
    const std::uint64_t count = bag::number(info.fields, "count", 4);
    require(count * kEntry == info.data.size(), "a chunk's description has the wrong size");
    const auto chunk = chunks_.find(static_cast<std::size_t>(bag::number(info.fields, "chunk_pos", 8)));
    require(chunk != chunks_.end(), "a chunk's description points beside it");
    require(count <= chunk->second.indices, "a chunk has fewer indices than its description says");
    for (const std::uint64_t connection : chunk->second.connections) {
      require(connections_.count(connection) != 0, "a chunk has messages of an unknown connection");
    }
  }

  std::string_view bytes_;
  std::map<std::size_t, IndexedChunk> chunks_;
  Connections connections_;
};

}  // namespace

void validateBag(const std::string& path) {
  namespace ipc = boost::interprocess;
  const ipc::file_mapping file(path.c_str(), ipc::read_only);
  const ipc::mapped_region region(file, ipc::read_only);
  const std::string_view bytes(static_cast<const char*>(region.get_address()), region.get_size());
  if (bytes.substr(0, 8) != kVersion.substr(0, 8)) throw DamagedBag("is not a bag");
  if (bytes.substr(0, kVersion.size()) != kVersion) throw DamagedBag("is a bag of another format than 2.0");
  Validator(bytes).run();
}

}  // namespace visual_localization

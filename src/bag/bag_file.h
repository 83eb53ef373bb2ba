#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace visual_localization::bag {

/// A bag whose records do not fit together. One line, without the path.
class DamagedBag : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A bag that may be whole, but is none that can be read. One line, without the path.
class UnsupportedBag : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What a record is (http://wiki.ros.org/Bags/Format/2.0).
enum class Op : std::uint8_t {
  kMessage = 2,
  kBagHeader = 3,
  kIndex = 4,
  kChunk = 5,
  kChunkInfo = 6,
  kConnection = 7,
};

/// The fields of a record's header by name.
using Fields = std::map<std::string, std::string>;

/// The bytes that records lie in.
class Bytes {
 public:
  Bytes() = default;
  Bytes(const Bytes&) = delete;
  Bytes& operator=(const Bytes&) = delete;
  virtual ~Bytes() = default;
  virtual std::uint64_t size() const = 0;
  /// `offset` + `count` lie within size(). Throws DamagedBag when they cannot be read.
  virtual void read(std::uint64_t offset, std::size_t count, char* to) const = 0;
};

/// Those of a file. Not mapped: a file that shrinks or a disk that fails must not end the program.
class FileBytes : public Bytes {
 public:
  /// Throws DamagedBag.
  explicit FileBytes(const std::string& path);
  ~FileBytes() override;
  FileBytes(const FileBytes&) = delete;
  FileBytes& operator=(const FileBytes&) = delete;
  std::uint64_t size() const override { return size_; }
  void read(std::uint64_t offset, std::size_t count, char* to) const override;

 private:
  int file_ = -1;
  std::uint64_t size_ = 0;
};

/// Those of an unpacked chunk, or of a whole bag.
class MemoryBytes : public Bytes {
 public:
  explicit MemoryBytes(std::string content) : content_(std::move(content)) {}
  std::uint64_t size() const override { return content_.size(); }
  void read(std::uint64_t offset, std::size_t count, char* to) const override;

 private:
  std::string content_;
};

/// From `begin` to before `end`.
struct Range {
  std::uint64_t begin = 0;
  std::uint64_t end = 0;

  std::uint64_t size() const { return end - begin; }
};

/// One record, without its data.
struct Record {
  Op op = Op::kMessage;
  Fields fields;
  Range data;  ///< where it lies; behind it the next record begins
};

/// At the beginning of `range`. Throws DamagedBag unless it lies within it.
Record readRecord(const Bytes& bytes, Range range);

/// Throws DamagedBag when there are more than `most` bytes: nobody makes us allocate more.
std::string readRange(const Bytes& bytes, Range range, std::uint64_t most, const char* what);

/// Without its length. Throws DamagedBag.
Fields readFields(std::string_view header);

/// Bytes of a record's header, and of the description of a connection.
constexpr std::uint64_t kLongestHeader = 1U << 24U;

/// Little-endian. Throws DamagedBag when the field is missing or has another size.
std::uint64_t number(const Fields& fields, const std::string& name, std::size_t size);

/// Little-endian; the bytes must exist.
std::uint64_t numberAt(std::string_view bytes, std::size_t offset, std::size_t size);

/// Where messages of one kind come from.
struct Connection {
  std::string topic;
  std::string type;
  std::string md5sum;  ///< of the definition of the type
};

/// Where a message lies.
struct Message {
  std::int64_t stamp_ns = 0;     ///< when it was recorded
  std::uint64_t chunk = 0;       ///< offset of its chunk's record in the file
  std::uint32_t offset = 0;      ///< of its record in the unpacked chunk
  std::uint32_t connection = 0;  ///< key in BagFile::connections
};

/// A bag (format 2.0) that may come from anyone: every length, offset and number in it is checked before it is used.
/// rosbag_storage does not check them and reads beyond its buffers; a check in front of it would take a reader like
/// this one and unpack every compressed chunk once more. Opening reads all records, but neither what messages hold nor
/// compressed chunks: a chunk is unpacked and checked when one of its messages is read, and kept with others up to
/// kMostUnpacked. Not thread-safe.
class BagFile {
 public:
  /// `bytes`: never null. Throws DamagedBag, or UnsupportedBag when the bag has no index, is encrypted or is of another
  /// version.
  explicit BagFile(std::unique_ptr<const Bytes> bytes);

  const std::map<std::uint32_t, Connection>& connections() const { return connections_; }
  /// In the order of recording.
  std::vector<Message> messages(const std::set<std::uint32_t>& connections) const;
  /// Throws DamagedBag when the chunk cannot be unpacked, or does not hold what its index says.
  std::string read(const Message& message);
  /// Of the unpacked chunks together; a larger chunk is kept alone.
  static constexpr std::uint64_t kMostUnpacked = 32U << 20U;
  std::uint64_t unpackedBytes() const { return unpacked_bytes_; }

 private:
  struct Chunk {
    Range data;
    std::string compression;
    std::uint64_t size = 0;                     ///< unpacked
    std::uint64_t index_bytes = 0;              ///< in the file
    std::vector<std::vector<Message>> indices;  ///< each of one connection
    bool described = false;                     ///< in the summary; otherwise its messages do not count
  };

  void readChunks(Range range);
  static void requireChunk(const Chunk& chunk);
  void readIndex(const Record& record, std::uint64_t chunk_at, Chunk& chunk) const;
  void readSummary(const Record& header, Range range);
  void readChunkInfo(const Record& info);
  static void checkMessages(const Bytes& bytes, Range range, const Chunk& chunk);
  const MemoryBytes& unpacked(std::uint64_t at, const Chunk& chunk);

  std::unique_ptr<const Bytes> file_;
  std::map<std::uint32_t, Connection> connections_;
  std::map<std::uint64_t, Chunk> chunks_;                           ///< by their offsets in the file
  std::map<std::uint64_t, std::unique_ptr<MemoryBytes>> unpacked_;  ///< chunks by their offsets in the file
  std::uint64_t unpacked_bytes_ = 0;
};

}  // namespace visual_localization::bag

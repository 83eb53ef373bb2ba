#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>

namespace visual_localization::bag {

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
  /// Copies `count` bytes from `offset`; they lie within size(). Throws DamagedBag when they cannot be read.
  virtual void read(std::uint64_t offset, std::size_t count, char* to) const = 0;
};

/// Those of a file. Not mapped: a file that shrinks or a disk that fails must not end the program.
class FileBytes : public Bytes {
 public:
  /// Throws DamagedBag when the file cannot be opened.
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

/// Those of an unpacked chunk.
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

/// Reads the record at the beginning of `range`. Throws DamagedBag unless it lies within it with everything in it.
Record readRecord(const Bytes& bytes, Range range);

/// Throws DamagedBag when there are more than `most` bytes, so that nobody makes us allocate more.
std::string readRange(const Bytes& bytes, Range range, std::uint64_t most, const char* what);

/// Reads the fields of a header without its length. Throws DamagedBag.
Fields readFields(std::string_view header);

/// The longest header of a record, and the longest description of a connection, in bytes.
constexpr std::uint64_t kLongestHeader = 1U << 24U;

/// A number of exactly `size` bytes, little-endian. Throws DamagedBag when the field is missing or has another size.
std::uint64_t number(const Fields& fields, const std::string& name, std::size_t size);

/// `size` bytes at `offset` as a little-endian number; they must exist.
std::uint64_t numberAt(std::string_view bytes, std::size_t offset, std::size_t size);

}  // namespace visual_localization::bag

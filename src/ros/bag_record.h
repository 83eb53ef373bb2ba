#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

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
using Fields = std::map<std::string_view, std::string_view>;

/// One record; views into the bytes that it was read from.
struct Record {
  Op op = Op::kMessage;
  Fields fields;
  std::string_view data;
  std::size_t end = 0;  ///< offset of the next record
};

/// Reads the record at `offset`. Throws DamagedBag unless it lies within `bytes` with everything in it.
Record readRecord(std::string_view bytes, std::size_t offset);

/// Reads the fields of a header without its length. Throws DamagedBag.
Fields readFields(std::string_view header);

/// A number of exactly `size` bytes, little-endian. Throws DamagedBag when the field is missing or has another size.
std::uint64_t number(const Fields& fields, std::string_view name, std::size_t size);

/// `size` bytes at `offset` as a little-endian number; they must exist.
std::uint64_t numberAt(std::string_view bytes, std::size_t offset, std::size_t size);

}  // namespace visual_localization::bag

#include "bag_record.h"

#include "visual_localization/ros/bag_validator.h"

namespace visual_localization::bag {
namespace {

constexpr std::size_t kLength = 4;  ///< bytes of a length

/// Takes a length and as many bytes from `bytes` at `offset`, and moves on.
std::string_view take(std::string_view bytes, std::size_t& offset, const char* what) {
  if (offset > bytes.size() || bytes.size() - offset < kLength) {
    throw DamagedBag(std::string("ends within ") + what + " at byte " + std::to_string(offset));
  }
  const auto length = static_cast<std::size_t>(numberAt(bytes, offset, kLength));
  offset += kLength;
  if (bytes.size() - offset < length) {
    throw DamagedBag(std::string(what) + " at byte " + std::to_string(offset) + " claims " + std::to_string(length) +
                     " bytes of " + std::to_string(bytes.size() - offset));
  }
  const std::string_view content = bytes.substr(offset, length);
  offset += length;
  return content;
}

}  // namespace

std::uint64_t numberAt(std::string_view bytes, std::size_t offset, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = size; i > 0; --i) value = value << 8U | static_cast<std::uint8_t>(bytes[offset + i - 1]);
  return value;
}

Fields readFields(std::string_view header) {
  Fields fields;
  for (std::size_t offset = 0; offset < header.size();) {
    const std::string_view field = take(header, offset, "a header field");
    const std::size_t equals = field.find('=');
    if (equals == std::string_view::npos || equals == 0) throw DamagedBag("a header field has no name");
    fields[field.substr(0, equals)] = field.substr(equals + 1);
  }
  return fields;
}

std::uint64_t number(const Fields& fields, std::string_view name, std::size_t size) {
  const auto found = fields.find(name);
  if (found == fields.end() || found->second.size() != size) {
    throw DamagedBag("field '" + std::string(name) + "' of a record is missing or has the wrong size");
  }
  return numberAt(found->second, 0, size);
}

Record readRecord(std::string_view bytes, std::size_t offset) {
  Record record;
  record.fields = readFields(take(bytes, offset, "a record's header"));
  const std::uint64_t op = number(record.fields, "op", 1);
  if (op < 2 || op > 7) throw DamagedBag("a record has the unknown type " + std::to_string(op));
  record.op = static_cast<Op>(op);
  record.data = take(bytes, offset, "a record's data");
  record.end = offset;
  return record;
}

}  // namespace visual_localization::bag

#include <cerrno>
#include <cstddef>
#include <cstring>
#include <string>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "bag/bag_file.h"

namespace visual_localization::bag {
namespace {

constexpr std::size_t kLength = 4;  ///< bytes of a length

/// Takes a length from the beginning of `range`; returns where its content lies.
Range take(const Bytes& bytes, Range range, const char* what) {
  if (range.size() < kLength) {
    throw DamagedBag(std::string("ends within ") + what + " at byte " + std::to_string(range.begin));
  }
  char raw[kLength];
  bytes.read(range.begin, kLength, raw);
  const std::uint64_t length = numberAt({raw, kLength}, 0, kLength);
  range.begin += kLength;
  if (range.size() < length) {
    throw DamagedBag(std::string(what) + " at byte " + std::to_string(range.begin) + " claims " +
                     std::to_string(length) + " bytes of " + std::to_string(range.size()));
  }
  return {range.begin, range.begin + length};
}

}  // namespace

FileBytes::FileBytes(const std::string& path) : file_(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
  if (file_ < 0) throw DamagedBag(std::string("cannot be opened: ") + std::strerror(errno));
  struct stat status {};
  if (::fstat(file_, &status) == 0) size_ = static_cast<std::uint64_t>(status.st_size);
}

FileBytes::~FileBytes() { ::close(file_); }

void FileBytes::read(std::uint64_t offset, std::size_t count, char* to) const {
  while (count > 0) {
    const ssize_t got = ::pread(file_, to, count, static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw DamagedBag(std::string("cannot be read: ") + std::strerror(errno));
    if (got == 0) throw DamagedBag("became shorter while it was read");
    offset += static_cast<std::uint64_t>(got);
    to += got;
    count -= static_cast<std::size_t>(got);
  }
}

void MemoryBytes::read(std::uint64_t offset, std::size_t count, char* to) const {
  content_.copy(to, count, static_cast<std::size_t>(offset));
}

std::string readRange(const Bytes& bytes, Range range, std::uint64_t most, const char* what) {
  if (range.size() > most) {
    throw DamagedBag(std::string(what) + " at byte " + std::to_string(range.begin) + " has " +
                     std::to_string(range.size()) + " bytes, at most " + std::to_string(most) + " are accepted");
  }
  std::string content(static_cast<std::size_t>(range.size()), '\0');
  bytes.read(range.begin, content.size(), content.data());
  return content;
}

std::uint64_t numberAt(std::string_view bytes, std::size_t offset, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = size; i > 0; --i) value = value << 8U | static_cast<std::uint8_t>(bytes[offset + i - 1]);
  return value;
}

Fields readFields(std::string_view header) {
  Fields fields;
  while (!header.empty()) {
    if (header.size() < kLength) throw DamagedBag("ends within a header field");
    const std::uint64_t length = numberAt(header, 0, kLength);
    header.remove_prefix(kLength);
    if (length > header.size()) throw DamagedBag("a header field is longer than its header");
    const std::string_view field = header.substr(0, static_cast<std::size_t>(length));
    const std::size_t equals = field.find('=');
    if (equals == std::string_view::npos || equals == 0) throw DamagedBag("a header field has no name");
    fields[std::string(field.substr(0, equals))] = std::string(field.substr(equals + 1));
    header.remove_prefix(field.size());
  }
  return fields;
}

std::uint64_t number(const Fields& fields, const std::string& name, std::size_t size) {
  const auto found = fields.find(name);
  if (found == fields.end() || found->second.size() != size) {
    throw DamagedBag("field '" + name + "' of a record is missing or has the wrong size");
  }
  return numberAt(found->second, 0, size);
}

Record readRecord(const Bytes& bytes, Range range) {
  const Range header = take(bytes, range, "a record's header");
  Record record;
  record.fields = readFields(readRange(bytes, header, kLongestHeader, "a record's header"));
  const std::uint64_t op = number(record.fields, "op", 1);
  if (op < 2 || op > 7) throw DamagedBag("a record has the unknown type " + std::to_string(op));
  record.op = static_cast<Op>(op);
  record.data = take(bytes, {header.end, range.end}, "a record's data");
  return record;
}

}  // namespace visual_localization::bag

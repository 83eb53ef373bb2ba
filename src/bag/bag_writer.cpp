#include "bag/bag_writer.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <filesystem>

#include <fcntl.h>
#include <unistd.h>

#include "bag/bag_file.h"
#include "base/files.h"

namespace visual_localization {
namespace {

using bag::Op;

const std::string kFirstLine = "#ROSBAG V2.0\n";
constexpr std::size_t kHeaderBytes = 4096;  ///< of the bag header with its padding, as rosbag has it
constexpr std::size_t kMostWaiting = 64U << 20U;

/// Little-endian.
template <class Number>
std::string bytesOf(Number number, std::size_t size = sizeof(Number)) {
  std::string bytes;
  for (std::size_t i = 0; i < size; ++i)
    bytes += static_cast<char>((static_cast<std::uint64_t>(number) >> (8 * i)) & 0xFFU);
  return bytes;
}

std::string bytesOf(const ros::Time& time) { return bytesOf(time.sec) + bytesOf(time.nsec); }

std::string withLength(const std::string& bytes) { return bytesOf(static_cast<std::uint32_t>(bytes.size())) + bytes; }

std::string fieldOf(const std::string& name, const std::string& value) { return withLength(name + "=" + value); }

std::string recordHeader(Op op, const std::string& fields) {
  return withLength(fieldOf("op", bytesOf(static_cast<std::uint8_t>(op))) + fields);
}

std::string bagHeader(std::uint64_t index_at, std::size_t connections, std::uint32_t chunks) {
  const std::string header = recordHeader(Op::kBagHeader, fieldOf("index_pos", bytesOf(index_at)) +
                                                              fieldOf("conn_count", bytesOf(connections, 4)) +
                                                              fieldOf("chunk_count", bytesOf(chunks)));
  return header + withLength(std::string(kHeaderBytes - header.size() - 4, ' '));
}

[[noreturn]] void fail(const std::string& path) { throw FileError(path + ": " + std::strerror(errno)); }

}  // namespace

std::string newSessionBag(const std::string& folder) {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  ::localtime_r(&now, &parts);
  std::array<char, 64> name{};
  std::strftime(name.data(), name.size(), "session_%Y-%m-%d-%H-%M-%S.bag", &parts);
  return (std::filesystem::path(folder) / name.data()).string();
}

BagWriter::BagWriter(const std::string& path)
    : path_(path), file_(::open(path.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0644)) {
  if (file_ < 0) fail(path_);
  end_ = kFirstLine.size() + kHeaderBytes;
  try {
    put(0, kFirstLine + bagHeader(end_, 0, 0));
    flush();
  } catch (...) {
    ::close(file_);
    ::unlink(path_.c_str());
    throw;
  }
}

BagWriter::~BagWriter() { ::close(file_); }

std::uint32_t BagWriter::connectionOf(const Kind& kind) {
  const auto [entry, is_new] =
      connections_.try_emplace({kind.topic, kind.type}, static_cast<std::uint32_t>(connections_.size()));
  if (is_new) {
    const std::string record =
        recordHeader(Op::kConnection, fieldOf("conn", bytesOf(entry->second)) + fieldOf("topic", kind.topic)) +
        withLength(fieldOf("topic", kind.topic) + fieldOf("type", kind.type) + fieldOf("md5sum", kind.md5sum) +
                   fieldOf("message_definition", kind.definition) + (kind.latched ? fieldOf("latching", "1") : ""));
    chunk_ += record;
    connection_records_ += record;
  }
  return entry->second;
}

bool BagWriter::add(const Kind& kind, const ros::Time& received, const std::string& bytes) {
  if (chunk_.size() + bytes.size() > kMostWaiting) return false;
  const std::uint32_t connection = connectionOf(kind);
  index_[connection].push_back({received, static_cast<std::uint32_t>(chunk_.size())});
  chunk_ += recordHeader(Op::kMessage, fieldOf("conn", bytesOf(connection)) + fieldOf("time", bytesOf(received)));
  chunk_ += withLength(bytes);
  return true;
}

/// Of the chunk, a record for each connection.
std::string BagWriter::indexRecords() const {
  std::string records;
  for (const auto& [connection, entries] : index_) {
    std::string data;
    for (const Entry& entry : entries) data += bytesOf(entry.received) + bytesOf(entry.offset);
    records +=
        recordHeader(Op::kIndex, fieldOf("ver", bytesOf(std::uint32_t{1})) + fieldOf("conn", bytesOf(connection)) +
                                     fieldOf("count", bytesOf(entries.size(), 4)));
    records += withLength(data);
  }
  return records;
}

/// Of the chunk, for the index of the whole bag.
std::string BagWriter::chunkInfo() const {
  ros::Time first = ros::TIME_MAX;
  ros::Time last = ros::TIME_MIN;
  std::string counts;
  for (const auto& [connection, entries] : index_) {
    for (const Entry& entry : entries) {
      first = std::min(first, entry.received);
      last = std::max(last, entry.received);
    }
    counts += bytesOf(connection) + bytesOf(entries.size(), 4);
  }
  return recordHeader(Op::kChunkInfo, fieldOf("ver", bytesOf(std::uint32_t{1})) + fieldOf("chunk_pos", bytesOf(end_)) +
                                          fieldOf("start_time", bytesOf(first)) + fieldOf("end_time", bytesOf(last)) +
                                          fieldOf("count", bytesOf(index_.size(), 4))) +
         withLength(counts);
}

void BagWriter::sync() {
  if (index_.empty()) return;
  const std::string chunk =
      recordHeader(Op::kChunk, fieldOf("compression", "none") + fieldOf("size", bytesOf(chunk_.size(), 4))) +
      withLength(chunk_) + indexRecords();
  const std::string chunk_infos = chunk_infos_ + chunkInfo();
  const std::string summary = connection_records_ + chunk_infos;
  const std::uint64_t index_at = end_ + chunk.size();
  put(end_, chunk + summary);
  flush();
  put(0, kFirstLine + bagHeader(index_at, connections_.size(), chunks_ + 1));
  flush();
  end_ = index_at + summary.size();
  chunk_infos_ = chunk_infos;
  ++chunks_;
  chunk_.clear();
  index_.clear();
}

void BagWriter::put(std::uint64_t offset, const std::string& bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t written =
        ::pwrite(file_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(offset + done));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail(path_);
    done += static_cast<std::size_t>(written);
  }
}

void BagWriter::flush() {
  if (::fdatasync(file_) != 0) fail(path_);
}

}  // namespace visual_localization

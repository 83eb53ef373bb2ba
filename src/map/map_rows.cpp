#include "map/map_rows.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>
#include <vector>

#include <sys/stat.h>

#include "map/map_schema.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization::map_rows {
namespace {

using sqlite::Bytes;
using sqlite::Statement;

/// The first 100 bytes of a database file, see https://www.sqlite.org/fileformat.html section 1.3. SQLite answers only
/// after it has parsed a schema, which may be anybody's, and takes a file with foreign bytes behind its end.
class FileHeader {
 public:
  explicit FileHeader(const std::string& path) {
    std::ifstream file;
    file.rdbuf()->pubsetbuf(nullptr, 0);  // no buffer for so few bytes
    file.open(path, std::ios::binary);
    if (!file) throw Refusal(std::string("cannot be opened: ") + std::strerror(errno));
    file.read(reinterpret_cast<char*>(bytes_.data()), static_cast<std::streamsize>(bytes_.size()));
    complete_ = file.gcount() == static_cast<std::streamsize>(bytes_.size());
  }

  bool isSqlite() const { return complete_ && std::memcmp(bytes_.data(), "SQLite format 3", 16) == 0; }
  std::int64_t userVersion() const { return number(60, 4); }
  std::int64_t applicationId() const { return number(68, 4); }
  /// Changes may wait in another file, the write-ahead log.
  bool hasLog() const { return number(18, 1) > 1 || number(19, 1) > 1; }
  bool isUtf8() const { return number(56, 4) == 1; }
  /// Bytes that the file must have.
  std::int64_t size() const {
    const std::int64_t page = number(16, 2);
    return (page == 1 ? 65536 : page) * number(28, 4);
  }

 private:
  std::int64_t number(std::size_t offset, std::size_t count) const {
    std::int64_t value = 0;
    for (std::size_t i = 0; i < count; ++i) value = value * 256 + bytes_[offset + i];
    return value;
  }

  std::array<std::uint8_t, 100> bytes_{};
  bool complete_ = false;
};

/// Refuses what is not a complete map of our version, before SQLite looks at it.
void requireMapFile(const std::string& path, std::int64_t size) {
  if (size == 0) throw Refusal("is empty");
  const FileHeader header(path);
  if (!header.isSqlite()) throw Refusal("is not a map");
  if (header.applicationId() != map_schema::kApplicationId) throw Refusal("is an SQLite file, but not a map");
  if (header.userVersion() != kMapSchemaVersion) {
    throw Refusal("has map version " + std::to_string(header.userVersion()) + ", but only version " +
                  std::to_string(kMapSchemaVersion) + " can be read; build it again");
  }
  if (header.hasLog()) throw Refusal("is damaged: it expects a write-ahead log, which no map has");
  if (!header.isUtf8()) throw Refusal("is damaged: its text is not UTF-8");
  if (header.size() != size) {
    throw Refusal("is damaged: has " + std::to_string(size) + " bytes instead of " + std::to_string(header.size()));
  }
}

/// A row of sqlite_master: name, type, sql.
using Definition = std::array<std::string, 3>;

/// Refuses any schema but ours: no view or trigger, no other table, no other definition.
void requireSchema(const sqlite::Database& database) {
  const auto& tables = map_schema::kTables;
  std::vector<Definition> found;
  // Not ordered by SQLite, which would read all of them first.
  Statement row(database, "SELECT name, type, sql FROM sqlite_master LIMIT " + std::to_string(tables.size() + 1));
  while (row.step()) found.push_back({row.text(0), row.text(1), row.text(2)});
  std::sort(found.begin(), found.end());
  for (std::size_t i = 0; i < tables.size(); ++i) {
    const map_schema::Table& table = tables[i];
    if (i == found.size()) throw Refusal(std::string("is damaged: table '") + table.name + "' is missing");
    if (found[i] == Definition{table.name, "table", table.sql}) continue;
    throw Refusal("is not a map: its schema has an unexpected " + found[i][1] + " '" + found[i][0] + "'");
  }
  if (found.size() > tables.size()) {
    throw Refusal("is not a map: its schema has an unexpected " + found.back()[1] + " '" + found.back()[0] + "'");
  }
}

void requireCount(std::size_t actual, std::size_t expected, const Statement& row) {
  if (actual == expected) return;
  throw Refusal("is damaged: " + imageName(row.integer(0)) + " has " + std::to_string(actual) +
                " features instead of " + std::to_string(expected));
}

void requireChecksum(std::int64_t computed, const Statement& row, int column, const char* what) {
  if (computed == row.integer(column)) return;
  throw Refusal(std::string("is damaged: ") + what + " of " + imageName(row.integer(0)) +
                " do not agree with their checksum");
}

}  // namespace

std::string imageName(std::int64_t id) { return "image " + std::to_string(id); }

std::int64_t fileSize(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) throw Refusal(std::strerror(errno));
  if (S_ISDIR(status.st_mode)) throw Refusal("is a folder, not a map");
  if (!S_ISREG(status.st_mode)) throw Refusal("is not a regular file");
  return static_cast<std::int64_t>(status.st_size);
}

sqlite::Database open(const std::string& path, std::int64_t size) {
  requireMapFile(path, size);
  sqlite::Database database = sqlite::Database::openUntrusted(path, std::min(size, map_schema::kMaxRowBytes));
  requireSchema(database);
  return database;
}

void Budget::spend(std::uint64_t bytes) {
  if (bytes > left_) throw Refusal("is damaged: its rows claim more bytes than the file has");
  left_ -= bytes;
}

LocalFeatures localOf(const Statement& row, std::int64_t seed, std::size_t count, const LocalFeatureKind& kind) {
  const Bytes keypoints = row.blob(1);
  const Bytes descriptors = row.blob(2);
  requireChecksum(map_schema::rowChecksum(seed, {keypoints, descriptors}), row, 3, "features");
  if (keypoints.size % map_schema::kKeypointBytes != 0) throw Refusal("is damaged: a keypoint is incomplete");
  requireCount(keypoints.size / map_schema::kKeypointBytes, count, row);
  // An address of null plus nothing is not a range, so the empty case goes its own way.
  if (descriptors.size == 0 && keypoints.size == 0) return {};
  return kind.unpack(map_schema::unpackKeypoints(keypoints), descriptors.data, descriptors.size);
}

GlobalFeatures globalOf(const Statement& row, std::int64_t seed) {
  const Bytes wgoh = row.blob(1);
  const Bytes wgii = row.blob(2);
  const GlobalFeatures features{map_schema::unpackHistogram(wgoh), map_schema::unpackHistogram(wgii)};
  requireChecksum(map_schema::rowChecksum(seed, {wgoh, wgii}), row, 3, "global features");
  return features;
}

VladDescriptor vladOf(const Statement& row, std::int64_t seed, std::size_t bytes) {
  const Bytes descriptor = row.blob(1);
  requireChecksum(map_schema::rowChecksum(seed, {descriptor}), row, 2, "bytes of the VLAD");
  if (descriptor.size != bytes) {
    throw Refusal("is damaged: the VLAD of " + imageName(row.integer(0)) + " has " + std::to_string(descriptor.size) +
                  " bytes instead of " + std::to_string(bytes));
  }
  VladDescriptor vlad(bytes);
  std::memcpy(vlad.data(), descriptor.data, bytes);
  return vlad;
}

std::vector<std::uint8_t> previewOf(const Statement& row, std::int64_t seed) {
  const Bytes jpeg = row.blob(1);
  requireChecksum(map_schema::rowChecksum(seed, {jpeg}), row, 2, "bytes of the preview");
  if (jpeg.size == 0) return {};
  return {jpeg.data, jpeg.data + jpeg.size};
}

ImageGeometry geometryOf(const Statement& row, std::int64_t seed, std::size_t feature_count) {
  const Bytes pose = row.blob(1);
  const Bytes points = row.blob(2);
  requireChecksum(map_schema::rowChecksum(seed, {pose, points}), row, 3, "landmarks");
  try {
    return map_schema::unpackGeometry(pose, points, feature_count);
  } catch (const std::runtime_error& error) {
    throw Refusal("is damaged: " + imageName(row.integer(0)) + ": " + error.what());
  }
}

}  // namespace visual_localization::map_rows

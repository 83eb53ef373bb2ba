#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <new>
#include <string>
#include <utility>

#include <sys/stat.h>

#include "visual_localization/map/map_schema.h"
#include "visual_localization/map/map_store.h"
#include "visual_localization/map/sqlite.h"

namespace visual_localization {
namespace {

using map_schema::ImageRow;
using sqlite::Bytes;
using sqlite::Statement;

/// Why a map is refused, without the path.
class Refusal : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Size of the regular file at `path`.
std::int64_t fileSize(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) throw Refusal(std::strerror(errno));
  if (S_ISDIR(status.st_mode)) throw Refusal("is a folder, not a map");
  if (!S_ISREG(status.st_mode)) throw Refusal("is not a regular file");
  return static_cast<std::int64_t>(status.st_size);
}

/// The first 100 bytes of a database file, see https://www.sqlite.org/fileformat.html section 1.3.
class FileHeader {
 public:
  explicit FileHeader(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) throw Refusal(std::string("cannot be opened: ") + std::strerror(errno));
    file.read(reinterpret_cast<char*>(bytes_.data()), static_cast<std::streamsize>(bytes_.size()));
    complete_ = file.gcount() == static_cast<std::streamsize>(bytes_.size());
  }

  bool isSqlite() const { return complete_ && std::memcmp(bytes_.data(), "SQLite format 3", 16) == 0; }
  std::int64_t userVersion() const { return number(60, 4); }
  std::int64_t applicationId() const { return number(68, 4); }
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
  if (header.size() != size) {
    throw Refusal("is damaged: has " + std::to_string(size) + " bytes instead of " + std::to_string(header.size()));
  }
}

/// Refuses any schema but our own: no view or trigger, no other table, no other definition.
void requireSchema(const sqlite::Database& database) {
  Statement found(database, "SELECT type, name, sql FROM sqlite_master ORDER BY name");
  for (const map_schema::Table& table : map_schema::kTables) {
    if (!found.step()) throw Refusal(std::string("is damaged: table '") + table.name + "' is missing");
    if (found.text(0) != "table" || found.text(1) != table.name || found.text(2) != table.sql) {
      throw Refusal("is not a map: its schema has an unexpected " + found.text(0) + " '" + found.text(1) + "'");
    }
  }
  if (found.step())
    throw Refusal("is not a map: its schema has an unexpected " + found.text(0) + " '" + found.text(1) + "'");
}

ParameterValue metaValue(const Statement& row) {
  switch (row.type(1)) {
    case Statement::Type::kInteger:
      return row.integer(1);
    case Statement::Type::kReal:
      return row.real(1);
    default:
      return row.text(1);
  }
}

ParameterValues readMeta(const sqlite::Database& database) {
  ParameterValues meta;
  Statement row(database, "SELECT key, value FROM meta");
  while (row.step()) meta[row.text(0)] = metaValue(row);
  return meta;
}

std::int64_t takeChecksum(ParameterValues& meta) {
  const auto found = meta.find("checksum");
  const std::int64_t* value = found == meta.end() ? nullptr : std::get_if<std::int64_t>(&found->second);
  if (value == nullptr) throw Refusal("is damaged: it has no checksum");
  const std::int64_t checksum = *value;
  meta.erase(found);
  return checksum;
}

ImageRow imageRow(const Statement& row) {
  ImageRow image;
  image.id = row.integer(0);
  image.session = row.integer(1);
  image.stamp_ns = row.integer(2);
  image.east_m = row.real(3);
  image.north_m = row.real(4);
  image.yaw_rad = row.real(5);
  image.feature_count = row.integer(6);
  image.global = {map_schema::unpackHistogram(row.blob(7)), map_schema::unpackHistogram(row.blob(8))};
  image.features_crc32 = row.integer(9);
  image.preview_crc32 = row.integer(10);
  return image;
}

std::string imageName(std::int64_t id) { return "image " + std::to_string(id); }

void requirePlausible(const ImageRow& row, std::size_t expected_id, std::size_t session_count) {
  if (row.id != static_cast<std::int64_t>(expected_id) || row.id >= map_schema::kMaxImages) {
    throw Refusal("is damaged: " + imageName(row.id) + " where " + imageName(static_cast<std::int64_t>(expected_id)) +
                  " should be");
  }
  if (row.session < 0 || row.session >= static_cast<std::int64_t>(session_count)) {
    throw Refusal("is damaged: " + imageName(row.id) + " belongs to the unknown session " +
                  std::to_string(row.session));
  }
  if (row.feature_count < 0 || row.feature_count > map_schema::kMaxFeaturesPerImage) {
    throw Refusal("is damaged: " + imageName(row.id) + " claims " + std::to_string(row.feature_count) + " features");
  }
  if (!std::isfinite(row.east_m) || !std::isfinite(row.north_m) || !std::isfinite(row.yaw_rad)) {
    throw Refusal("is damaged: position of " + imageName(row.id) + " is not finite");
  }
}

SiftFeatures decodeFeatures(const ImageRow& image, Bytes keypoints, Bytes descriptors) {
  const auto count = static_cast<std::size_t>(image.feature_count);
  if (keypoints.size != count * map_schema::kKeypointBytes ||
      descriptors.size != count * SiftFeatures::kDescriptorSize ||
      map_schema::crc32Of(descriptors, map_schema::crc32Of(keypoints)) != image.features_crc32) {
    throw Refusal("is damaged: features of " + imageName(image.id) + " do not agree with their checksum");
  }
  // An address of null plus nothing is not a range, so the empty case goes its own way.
  if (count == 0) return {};
  return SiftFeatures(map_schema::unpackKeypoints(keypoints), {descriptors.data, descriptors.data + descriptors.size});
}

std::vector<std::uint8_t> decodePreview(const ImageRow& image, Bytes jpeg) {
  if (map_schema::crc32Of(jpeg) != image.preview_crc32) {
    throw Refusal("is damaged: preview of " + imageName(image.id) + " does not agree with its checksum");
  }
  if (jpeg.size == 0) return {};
  return {jpeg.data, jpeg.data + jpeg.size};
}

/// The features and the preview of one image at a time, each verified when it is read.
class ContentReader {
 public:
  explicit ContentReader(const sqlite::Database& database)
      : features_(database, "SELECT image, keypoints, descriptors FROM features ORDER BY image"),
        previews_(database, "SELECT image, jpeg FROM previews ORDER BY image") {
    preview_left_ = previews_.step();
  }

  /// To be called in order of the images.
  void read(const ImageRow& row, TrainingImage& image) {
    if (!features_.step() || features_.integer(0) != row.id) {
      throw Refusal("is damaged: features of " + imageName(row.id) + " are missing");
    }
    image.sift = decodeFeatures(row, features_.blob(1), features_.blob(2));
    const bool has_preview = preview_left_ && previews_.integer(0) == row.id;
    image.preview_jpeg = decodePreview(row, has_preview ? previews_.blob(1) : Bytes{});
    if (has_preview) preview_left_ = previews_.step();
  }

  void requireEnd() {
    if (preview_left_ || features_.step()) throw Refusal("is damaged: it has features or previews without an image");
  }

 private:
  Statement features_;
  Statement previews_;
  bool preview_left_ = false;
};

/// Reads and verifies everything small: the images come back without features and previews.
std::vector<ImageRow> readRows(const sqlite::Database& database, std::size_t session_count,
                               map_schema::Checksum& checksum) {
  std::vector<ImageRow> rows;
  Statement row(database,
                "SELECT id, session, stamp_ns, east_m, north_m, yaw_rad, feature_count, wgoh, wgii, features_crc32, "
                "preview_crc32 FROM images ORDER BY id");
  while (row.step()) {
    ImageRow image = imageRow(row);
    requirePlausible(image, rows.size(), session_count);
    image.addTo(checksum);
    rows.push_back(image);
  }
  return rows;
}

TrainingImage withoutFeatures(const ImageRow& row) {
  TrainingImage image;
  image.stamp_ns = row.stamp_ns;
  image.session = static_cast<int>(row.session);
  image.position_m = {row.east_m, row.north_m};
  image.yaw_rad = row.yaw_rad;
  image.global = row.global;
  return image;
}

std::shared_ptr<const TrainingMap> readMap(const sqlite::Database& database) {
  requireSchema(database);
  ParameterValues meta = readMeta(database);
  const std::int64_t expected = takeChecksum(meta);
  map_schema::Checksum checksum;
  checksum.add(meta);
  MapHeader header = map_schema::toHeader(std::move(meta));
  const std::vector<ImageRow> rows = readRows(database, header.sessions.size(), checksum);
  if (checksum.value() != expected) throw Refusal("is damaged: its content does not agree with its checksum");

  std::vector<TrainingImage> images;
  images.reserve(rows.size());
  ContentReader content(database);
  for (const ImageRow& row : rows) {
    images.push_back(withoutFeatures(row));
    content.read(row, images.back());
  }
  content.requireEnd();
  return std::make_shared<const TrainingMap>(std::move(header), std::move(images));
}

/// Runs `read` on the opened file and puts the path in front of whatever it throws.
template <class Read>
auto withMapFile(const std::string& path, Read read) {
  try {
    const std::int64_t size = fileSize(path);
    requireMapFile(path, size);
    const sqlite::Database database = sqlite::Database::openUntrusted(path, size);
    return read(database);
  } catch (const Refusal& refusal) {
    throw MapStoreError(path + ": " + refusal.what());
  } catch (const std::bad_alloc&) {
    throw MapStoreError(path + ": there is not enough memory for this map");
  } catch (const std::exception& error) {
    throw MapStoreError(path + ": is damaged: " + error.what());
  }
}

void requireIntegrity(const sqlite::Database& database) {
  Statement check(database, "PRAGMA integrity_check(1)");
  if (!check.step()) throw Refusal("is damaged: its structure cannot be checked");
  if (const std::string answer = check.text(0); answer != "ok") throw Refusal("is damaged: " + answer);
}

}  // namespace

std::shared_ptr<const TrainingMap> loadMap(const std::string& path) { return withMapFile(path, readMap); }

void checkMap(const std::string& path) {
  withMapFile(path, [](const sqlite::Database& database) {
    readMap(database);
    requireIntegrity(database);
  });
}

std::string packageVersionOf(const std::string& path) {
  return withMapFile(path, [](const sqlite::Database& database) {
    requireSchema(database);
    const ParameterValues meta = readMeta(database);
    const auto found = meta.find("package_version");
    if (found == meta.end()) throw Refusal("is damaged: it has no package version");
    return parameters::toString(found->second);
  });
}

}  // namespace visual_localization

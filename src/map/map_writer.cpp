#include <string>

#include "visual_localization/io/partial_file.h"
#include "visual_localization/map/map_schema.h"
#include "visual_localization/map/map_store.h"
#include "visual_localization/map/sqlite.h"

namespace visual_localization {
namespace {

using map_schema::ImageRow;
using sqlite::Bytes;
using sqlite::Statement;

void createTables(sqlite::Database& database) {
  database.execute("PRAGMA application_id = " + std::to_string(map_schema::kApplicationId));
  database.execute("PRAGMA user_version = " + std::to_string(kMapSchemaVersion));
  for (const map_schema::Table& table : map_schema::kTables) database.execute(table.sql);
}

/// Fills the tables image by image.
class Writer {
 public:
  explicit Writer(sqlite::Database& database)
      : meta_(database, "INSERT INTO meta VALUES(?,?)"),
        images_(database, "INSERT INTO images VALUES(?,?,?,?,?,?,?,?,?,?,?)"),
        features_(database, "INSERT INTO features VALUES(?,?,?)"),
        previews_(database, "INSERT INTO previews VALUES(?,?)") {}

  void writeMeta(const ParameterValues& values) {
    checksum_.add(values);
    for (const auto& [key, value] : values) {
      meta_.bind(0, key);
      if (const auto* integer = std::get_if<std::int64_t>(&value)) meta_.bind(1, *integer);
      if (const auto* real = std::get_if<double>(&value)) meta_.bind(1, *real);
      if (const auto* text = std::get_if<std::string>(&value)) meta_.bind(1, *text);
      meta_.run();
    }
  }

  void writeImage(std::size_t index, const TrainingImage& image) {
    const std::vector<std::uint8_t> keypoints = map_schema::packKeypoints(image.sift.keypoints());
    const Bytes keypoint_bytes{keypoints.data(), keypoints.size()};
    const Bytes descriptor_bytes{image.sift.descriptors().data(), image.sift.descriptors().size()};
    const Bytes preview_bytes{image.preview_jpeg.data(), image.preview_jpeg.size()};

    ImageRow row;
    row.id = static_cast<std::int64_t>(index);
    row.session = image.session;
    row.stamp_ns = image.stamp_ns;
    row.east_m = image.position_m.x();
    row.north_m = image.position_m.y();
    row.yaw_rad = image.yaw_rad;
    row.feature_count = static_cast<std::int64_t>(image.sift.size());
    row.global = image.global;
    row.features_crc32 = map_schema::crc32Of(descriptor_bytes, map_schema::crc32Of(keypoint_bytes));
    row.preview_crc32 = map_schema::crc32Of(preview_bytes);
    writeRow(row);
    writeFeatures(row.id, keypoint_bytes, descriptor_bytes);
    if (preview_bytes.size > 0) writePreview(row.id, preview_bytes);
  }

  /// To be called last: it covers everything written before.
  void writeChecksum() {
    meta_.bind(0, std::string("checksum"));
    meta_.bind(1, checksum_.value());
    meta_.run();
  }

 private:
  void writeRow(const ImageRow& row) {
    row.addTo(checksum_);
    images_.bind(0, row.id);
    images_.bind(1, row.session);
    images_.bind(2, row.stamp_ns);
    images_.bind(3, row.east_m);
    images_.bind(4, row.north_m);
    images_.bind(5, row.yaw_rad);
    images_.bind(6, row.feature_count);
    const std::vector<std::uint8_t> wgoh = map_schema::packHistogram(row.global.wgoh);
    const std::vector<std::uint8_t> wgii = map_schema::packHistogram(row.global.wgii);
    images_.bind(7, Bytes{wgoh.data(), wgoh.size()});
    images_.bind(8, Bytes{wgii.data(), wgii.size()});
    images_.bind(9, row.features_crc32);
    images_.bind(10, row.preview_crc32);
    images_.run();
  }

  void writeFeatures(std::int64_t image, Bytes keypoints, Bytes descriptors) {
    features_.bind(0, image);
    features_.bind(1, keypoints);
    features_.bind(2, descriptors);
    features_.run();
  }

  void writePreview(std::int64_t image, Bytes jpeg) {
    previews_.bind(0, image);
    previews_.bind(1, jpeg);
    previews_.run();
  }

  Statement meta_;
  Statement images_;
  Statement features_;
  Statement previews_;
  map_schema::Checksum checksum_;
};

void fill(sqlite::Database& database, const TrainingMap& map) {
  createTables(database);
  Writer writer(database);
  writer.writeMeta(map_schema::toMeta(map.header()));
  for (std::size_t i = 0; i < map.size(); ++i) writer.writeImage(i, map.image(i));
  writer.writeChecksum();
}

void requireStorable(const TrainingMap& map) {
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (map.image(i).sift.size() <= static_cast<std::size_t>(map_schema::kMaxFeaturesPerImage)) continue;
    throw sqlite::Error("image " + std::to_string(i) + " has " + std::to_string(map.image(i).sift.size()) +
                        " features, the limit is " + std::to_string(map_schema::kMaxFeaturesPerImage));
  }
}

}  // namespace

void saveMap(const TrainingMap& map, const std::string& path) {
  try {
    requireStorable(map);
    PartialFile file(path);
    sqlite::Database database = sqlite::Database::create(file.path());
    database.execute("BEGIN");
    fill(database, map);
    database.execute("COMMIT");
    database.close();
    file.commit();
  } catch (const sqlite::Error& error) {
    throw MapStoreError(path + ": cannot be written: " + error.what());
  } catch (const FileError& error) {
    throw MapStoreError(error.what());
  }
}

}  // namespace visual_localization

#include "map/map_writer.h"

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "base/files.h"
#include "features/image_size.h"
#include "map/map_schema.h"
#include "map/sqlite.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization {
namespace {

using map_schema::ImageRow;
using sqlite::Bytes;
using sqlite::Statement;

Bytes bytesOf(const std::vector<std::uint8_t>& bytes) { return {bytes.data(), bytes.size()}; }

std::optional<map_schema::PackedGeometry> packedGeometry(std::int64_t id, const TrainingImage& image) {
  if (!image.geometry) return std::nullopt;
  try {
    return map_schema::packGeometry(*image.geometry, image.local.size());
  } catch (const std::runtime_error& error) {
    throw sqlite::Error("image " + std::to_string(id) + ": " + error.what());
  }
}

sqlite::Database createTables(const std::string& path) {
  sqlite::Database database = sqlite::Database::create(path);
  database.execute("BEGIN");
  database.execute("PRAGMA application_id = " + std::to_string(map_schema::kApplicationId));
  database.execute("PRAGMA user_version = " + std::to_string(kMapSchemaVersion));
  for (const map_schema::Table& table : map_schema::kTables) {
    database.execute(table.sql);
  }
  return database;
}

/// Runs `write` and puts the path in front of whatever it throws.
template <class Write>
auto withPath(const std::string& path, Write write) {
  try {
    return write();
  } catch (const sqlite::Error& error) {
    throw MapStoreError(path + ": cannot be written: " + error.what());
  } catch (const FileError& error) {
    throw MapStoreError(error.what());
  }
}

}  // namespace

/// The open file and what has been written to it.
class MapWriter::Tables {
 public:
  Tables(const PartialFile& file, Kind kind)
      : kind_(std::move(kind)),
        database_(createTables(file.path())),
        feature_rows_(std::make_unique<FeatureRows>(database_)) {}

  void append(const TrainingImage& image) {
    requireStorable(image);
    poses_.add(image, image.local.size());
    feature_rows_->write(map_schema::rowOf(poses_, poses_.size() - 1), image, *kind_);
    if (poses_.size() == 1) vlad_bytes_ = image.vlad.size();
    if (image.vlad.size() != vlad_bytes_) throw sqlite::Error("its images have VLAD of different vocabularies");
    if (image.geometry) ++geometry_count_;
  }

  void finish(const MapHeader& header) {
    // What is written can be opened.
    if (header.kind->name() != kind_->name())
      throw sqlite::Error("its local features are not '" + header.kind->name() + "'");
    if (const auto reason = whyTooLarge(header.image_size)) throw sqlite::Error("its images are too large: " + *reason);
    if (vlad_bytes_ != (header.vocabulary ? header.vocabulary->bytes() : 0)) {
      throw sqlite::Error("the VLAD of its images is not of its vocabulary");
    }
    // Behind each other in the file, because they are read together when the map is opened.
    for (std::size_t i = 0; i < poses_.size(); ++i) writePose(i);
    writeMeta(metaOf(header));
    writeMasks(header.sessions);
    if (header.vocabulary) writeVocabulary(*header.vocabulary);
    feature_rows_.reset();
    pose_row_.reset();
    database_.execute("COMMIT");
    database_.close();
  }

 private:
  /// The rows of the wide tables: what a comparison needs of an image.
  class FeatureRows {
   public:
    explicit FeatureRows(const sqlite::Database& database)
        : features_(database, "INSERT INTO features VALUES(?,?,?,?)"),
          globals_(database, "INSERT INTO globals VALUES(?,?,?,?)"),
          previews_(database, "INSERT INTO previews VALUES(?,?,?)"),
          landmarks_(database, "INSERT INTO landmarks VALUES(?,?,?,?)"),
          vlads_(database, "INSERT INTO vlads VALUES(?,?,?)") {}

    void write(const ImageRow& row, const TrainingImage& image, const LocalFeatureKind& kind) {
      const std::optional<map_schema::PackedGeometry> geometry = packedGeometry(row.id, image);
      const std::vector<std::uint8_t> keypoints = map_schema::packKeypoints(image.local.keypoints());
      const std::vector<std::uint8_t> wgoh = map_schema::packHistogram(image.global.wgoh);
      const std::vector<std::uint8_t> wgii = map_schema::packHistogram(image.global.wgii);
      const std::vector<std::uint8_t> descriptors = kind.pack(image.local);
      writeRow(features_, row, {bytesOf(keypoints), bytesOf(descriptors)});
      writeRow(globals_, row, {bytesOf(wgoh), bytesOf(wgii)});
      writeRow(previews_, row, {bytesOf(image.preview_jpeg)});
      if (!image.vlad.empty()) {
        writeRow(vlads_, row, {{reinterpret_cast<const std::uint8_t*>(image.vlad.data()), image.vlad.size()}});
      }
      if (geometry) writeRow(landmarks_, row, {bytesOf(geometry->pose), bytesOf(geometry->points)});
    }

   private:
    static void writeRow(Statement& insert, const ImageRow& row, std::initializer_list<Bytes> blobs) {
      int column = 0;
      insert.bind(column++, row.id);
      for (const Bytes& blob : blobs) insert.bind(column++, blob);
      insert.bind(column, map_schema::rowChecksum(map_schema::rowSeed(row), blobs));
      insert.run();
    }

    Statement features_;
    Statement globals_;
    Statement previews_;
    Statement landmarks_;
    Statement vlads_;
  };

  void requireStorable(const TrainingImage& image) const {
    if (image.local.size() <= static_cast<std::size_t>(map_schema::kMaxFeaturesPerImage)) return;
    throw sqlite::Error("image " + std::to_string(poses_.size()) + " has " + std::to_string(image.local.size()) +
                        " features, the limit is " + std::to_string(map_schema::kMaxFeaturesPerImage));
  }

  ParameterValues metaOf(const MapHeader& header) const {
    try {
      return map_schema::toMeta(header, geometry_count_);
    } catch (const std::runtime_error& error) {
      throw sqlite::Error(error.what());
    }
  }

  void writePose(std::size_t i) {
    if (!pose_row_) pose_row_ = std::make_unique<Statement>(database_, "INSERT INTO images VALUES(?,?,?,?,?,?,?)");
    const ImageRow row = map_schema::rowOf(poses_, i);
    row.addTo(checksum_);
    pose_row_->bind(0, row.id);
    pose_row_->bind(1, row.session);
    pose_row_->bind(2, row.stamp_ns);
    pose_row_->bind(3, row.east_m);
    pose_row_->bind(4, row.north_m);
    pose_row_->bind(5, row.yaw_rad);
    pose_row_->bind(6, row.feature_count);
    pose_row_->run();
  }

  /// To be called last: the checksum among its values covers the poses as well.
  void writeMeta(ParameterValues meta) {
    checksum_.add(meta);
    meta["checksum"] = checksum_.value();
    Statement row(database_, "INSERT INTO meta VALUES(?,?)");
    for (const auto& [key, value] : meta) {
      row.bind(0, key);
      if (const auto* integer = std::get_if<std::int64_t>(&value)) row.bind(1, *integer);
      if (const auto* real = std::get_if<double>(&value)) row.bind(1, *real);
      if (const auto* text = std::get_if<std::string>(&value)) row.bind(1, *text);
      row.run();
    }
  }

  void writeMasks(const std::vector<Session>& sessions) {
    Statement row(database_, "INSERT INTO masks VALUES(?,?)");
    for (std::size_t i = 0; i < sessions.size(); ++i) {
      if (sessions[i].mask.empty()) continue;
      const std::vector<std::uint8_t> bits = map_schema::packMask(sessions[i].mask);
      row.bind(0, static_cast<std::int64_t>(i));
      row.bind(1, bytesOf(bits));
      row.run();
    }
  }

  void writeVocabulary(const VladVocabulary& vocabulary) {
    const std::vector<std::uint8_t> learnt = map_schema::packVocabulary(vocabulary);
    Statement row(database_, "INSERT INTO vocabulary VALUES(0,?)");
    row.bind(0, bytesOf(learnt));
    row.run();
  }

  Kind kind_;
  sqlite::Database database_;
  std::unique_ptr<FeatureRows> feature_rows_;
  std::unique_ptr<Statement> pose_row_;
  TrainingPoses poses_;
  std::size_t geometry_count_ = 0;
  std::size_t vlad_bytes_ = 0;  ///< of each image
  map_schema::Checksum checksum_;
};

MapLoading strictLoading(std::size_t cache_bytes) {
  return {cache_bytes, [](const std::string& reason) { throw MapStoreError(reason); }};
}

MapWriter::MapWriter(const std::string& path, Kind kind)
    : path_(path),
      file_(withPath(path, [&path] { return std::make_unique<PartialFile>(path); })),
      tables_(withPath(path, [&] { return std::make_unique<Tables>(*file_, std::move(kind)); })) {}

MapWriter::MapWriter(const PartialFile& file, Kind kind)
    : path_(file.path()), tables_(withPath(path_, [&] { return std::make_unique<Tables>(file, std::move(kind)); })) {}

MapWriter::~MapWriter() = default;

void MapWriter::append(const TrainingImage& image) {
  withPath(path_, [&] { tables_->append(image); });
}

void MapWriter::finish(const MapHeader& header) {
  withPath(path_, [&] {
    tables_->finish(header);
    if (file_) file_->commit();
  });
}

void saveMap(const TrainingMap& map, const std::string& path) {
  MapWriter writer(path, map.header().kind);
  for (std::size_t i = 0; i < map.size(); ++i) writer.append(map.image(i));
  writer.finish(map.header());
}

}  // namespace visual_localization

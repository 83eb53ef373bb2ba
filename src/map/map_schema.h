#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "visual_localization/features/global_features.h"
#include "visual_localization/features/sift_features.h"
#include "visual_localization/map/map_file.h"
#include "visual_localization/map/training_map.h"
#include "visual_localization/parameters/parameters.h"

struct sqlite3;
struct sqlite3_stmt;

/// The few parts of SQLite that a map needs, as objects that clean up after themselves.
namespace visual_localization::sqlite {

/// What SQLite reports, without the path: whoever catches it knows that.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A file that SQLite does not even open.
class OpenError : public Error {
 public:
  using Error::Error;
};

/// Bytes inside a row; valid until the statement steps on.
struct Bytes {
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;
};

/// An open database file.
class Database {
 public:
  /// For files that may come from anyone: nothing is written beside or into the file, nothing in its schema is
  /// executed, and neither a large schema nor a value longer than `max_value_bytes` is read.
  static Database openUntrusted(const std::string& path, std::int64_t max_value_bytes);
  /// For filling a new file as fast as the disk takes it: without journal, so only for a file that is thrown
  /// away when anything fails. `path` is an empty file.
  static Database create(const std::string& path);

  ~Database();
  Database(Database&& other) noexcept;
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  void execute(const std::string& sql);
  /// Closes the file and reports what the destructor could not.
  void close();
  sqlite3* handle() const { return handle_; }

 private:
  explicit Database(sqlite3* handle) : handle_(handle) {}
  sqlite3* handle_ = nullptr;
};

/// One prepared statement. Parameters and columns count from 0.
class Statement {
 public:
  Statement(const Database& database, const std::string& sql);
  ~Statement();
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  void bind(int parameter, std::int64_t value);
  void bind(int parameter, double value);
  void bind(int parameter, const std::string& value);
  /// The bytes must outlive the next run().
  void bind(int parameter, Bytes value);

  /// Goes to the next row; false when there is none.
  bool step();
  /// Executes a statement that has no rows and makes it ready for the next values.
  void run();
  /// Ready to be executed anew; whatever went wrong before is forgotten.
  void reset();

  enum class Type { kInteger, kReal, kText, kBlob, kNull };
  Type type(int column) const;
  // Each throws Error when the column holds another type, so that nothing is converted silently.
  std::int64_t integer(int column) const;
  double real(int column) const;
  std::string text(int column) const;
  Bytes blob(int column) const;

 private:
  void require(int column, Type type) const;

  sqlite3* database_;
  sqlite3_stmt* statement_ = nullptr;
};

}  // namespace visual_localization::sqlite

/// What is where in a map file; shared by its reader and its writer.
namespace visual_localization::map_schema {

/// "vlmp" in the file's header (PRAGMA application_id): tells a map from any other SQLite file.
constexpr std::int64_t kApplicationId = 0x766C6D70;
constexpr std::int64_t kMaxImages = 100'000'000;
constexpr std::int64_t kMaxFeaturesPerImage = 1'000'000;
constexpr std::size_t kHistogramBytes = GlobalFeatures::kSize * sizeof(float);
constexpr std::size_t kKeypointBytes = 16;
/// Of the largest row that may be read: the features of one image. Its landmarks are smaller.
constexpr std::int64_t kMaxRowBytes =
    kMaxFeaturesPerImage * static_cast<std::int64_t>(kKeypointBytes + SiftFeatures::kDescriptorSize) + 4096;

/// From this version on sessions have a camera and a mask.
constexpr int kSinceCameras = 4;
/// From this version on images have a geometry.
constexpr int kSinceLandmarks = 4;
/// From this version on the checksum of a row covers all that the table `images` says of its image.
constexpr int kSinceBoundRows = 5;
/// From this version on a map has a history.
constexpr int kSinceHistory = 6;

struct Table {
  const char* name;
  const char* sql;
  int since = kOldestMapSchemaVersion;  ///< the version of the schema that it came with
};

/// All that may be in the schema of a map of this version, in order of name.
std::vector<Table> tablesOf(int version);

/// CRC-32 over a sequence of values, each in one byte order on every machine.
class Checksum {
 public:
  void add(std::int64_t value);
  void add(double value);
  void add(const std::string& value);
  void add(const ParameterValues& values);
  void addRaw(const std::uint8_t* data, std::size_t size);
  std::int64_t value() const { return value_; }

 private:
  std::uint32_t value_ = 0;
};

/// CRC-32 of some bytes, continuing from `previous`.
std::int64_t crc32Of(sqlite::Bytes bytes, std::int64_t previous = 0);

/// One row of the table `images`: where an image was taken. All of them are read when a map is opened, so they are
/// small and hold nothing that only a comparison needs.
struct ImageRow {
  std::int64_t id = 0;
  std::int64_t session = 0;
  std::int64_t stamp_ns = 0;
  double east_m = 0.0;
  double north_m = 0.0;
  double yaw_rad = 0.0;
  std::int64_t feature_count = 0;

  void addTo(Checksum& checksum) const;
};

/// The row of image `i`.
ImageRow rowOf(const TrainingPoses& poses, std::size_t i);

/// What the checksums of an image's rows in the wide tables begin with, so that exchanged rows are found, and those of
/// another map that was copied over an open one. Before kSinceBoundRows it is of the image's number alone.
std::int64_t rowSeed(const ImageRow& image, int version = kMapSchemaVersion);

/// Those of all images.
std::vector<std::uint32_t> rowSeeds(const TrainingPoses& poses, int version);

/// CRC-32 of a row of a wide table: its blobs, continuing from rowSeed().
std::int64_t rowChecksum(std::int64_t seed, std::initializer_list<sqlite::Bytes> blobs);

/// One bit a pixel, row by row, the first pixel in the highest bit; the last byte is filled up with zeros.
std::vector<std::uint8_t> packMask(const Mask& mask);
/// Inverse of packMask(). Throws std::runtime_error unless there are as many bytes as `size` needs.
Mask unpackMask(sqlite::Bytes bytes, const cv::Size& size);

/// Four little-endian 32-bit floats a keypoint: x, y, size, angle.
std::vector<std::uint8_t> packKeypoints(const std::vector<SiftKeypoint>& keypoints);
/// Inverse of packKeypoints(). Throws std::runtime_error when a value is not finite.
std::vector<SiftKeypoint> unpackKeypoints(sqlite::Bytes bytes);

/// 128 little-endian 32-bit floats.
std::vector<std::uint8_t> packHistogram(const GlobalFeatures::Histogram& histogram);
/// Inverse of packHistogram(). Throws std::runtime_error when the size is wrong or a value is not finite or negative.
GlobalFeatures::Histogram unpackHistogram(sqlite::Bytes bytes);

/// The header as rows of the table `meta`, without the checksum. Of a mask they hold the checksum of its bits, of the
/// table of landmarks the number of its rows: to count them all of it would have to be read.
ParameterValues toMeta(const MapHeader& header, std::size_t geometry_count);
/// Removes from `meta` how many images of a map of this version have a geometry, and returns it. Throws
/// std::runtime_error when it is missing or not in [0, kMaxImages].
std::size_t takeGeometryCount(ParameterValues& meta, int version);
/// Masks as they are stored, by the number of their session.
using MaskBits = std::map<std::int64_t, std::vector<std::uint8_t>>;
/// Inverse of toMeta() for a map of this version, but for what takeGeometryCount() takes. Throws std::runtime_error
/// when a value or a mask is missing, unknown, of the wrong type or out of range, and when a mask does not agree with
/// its checksum.
MapHeader toHeader(ParameterValues meta, int version, const MaskBits& masks);

}  // namespace visual_localization::map_schema

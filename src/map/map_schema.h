#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <map>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "map/sqlite.h"
#include "visual_localization/features/global_features.h"
#include "visual_localization/features/local_features.h"
#include "visual_localization/features/vlad.h"
#include "visual_localization/geometry/image_geometry.h"
#include "visual_localization/map/map_file.h"
#include "visual_localization/map/training_map.h"
#include "visual_localization/parameters/parameters.h"

/// What is where in a map file; shared by its reader and its writer.
namespace visual_localization::map_schema {

/// "vlmp" in the file's header (PRAGMA application_id): tells a map from any other SQLite file.
constexpr std::int64_t kApplicationId = 0x766C6D70;
constexpr std::int64_t kMaxImages = 100'000'000;
constexpr std::int64_t kMaxFeaturesPerImage = kMostLocalFeatures;
constexpr std::int64_t kMaxDescriptorBytes = 1024;  ///< of one descriptor in a file
constexpr std::size_t kMaxSessions = 10'000;
constexpr std::size_t kMaxNameBytes = 1000;      ///< of a session; each image that is exported has one
constexpr std::size_t kMaxMetaValues = 400'000;  ///< a session has about 30
constexpr std::size_t kHistogramBytes = GlobalFeatures::kSize * sizeof(float);
constexpr std::size_t kKeypointBytes = 16;
/// Of the largest row that may be read: the features of one image. Its landmarks are smaller.
constexpr std::int64_t kMaxRowBytes =
    kMaxFeaturesPerImage * (static_cast<std::int64_t>(kKeypointBytes) + kMaxDescriptorBytes) + 4096;

struct Table {
  const char* name;
  const char* sql;
};

/// All that is in the schema of a map, in order of name.
constexpr std::array<Table, 9> kTables{{
    {"features",
     "CREATE TABLE features(image INTEGER PRIMARY KEY, keypoints BLOB NOT NULL, descriptors BLOB NOT NULL, "
     "crc32 INTEGER NOT NULL)"},
    {"globals",
     "CREATE TABLE globals(image INTEGER PRIMARY KEY, wgoh BLOB NOT NULL, wgii BLOB NOT NULL, crc32 INTEGER NOT NULL)"},
    {"images",
     "CREATE TABLE images(id INTEGER PRIMARY KEY, session INTEGER NOT NULL, stamp_ns INTEGER NOT NULL, "
     "east_m REAL NOT NULL, north_m REAL NOT NULL, yaw_rad REAL NOT NULL, feature_count INTEGER NOT NULL)"},
    {"landmarks",
     "CREATE TABLE landmarks(image INTEGER PRIMARY KEY, pose BLOB NOT NULL, points BLOB NOT NULL, "
     "crc32 INTEGER NOT NULL)"},
    {"masks", "CREATE TABLE masks(session INTEGER PRIMARY KEY, bits BLOB NOT NULL)"},
    {"meta", "CREATE TABLE meta(key TEXT PRIMARY KEY, value NOT NULL) WITHOUT ROWID"},
    {"previews", "CREATE TABLE previews(image INTEGER PRIMARY KEY, jpeg BLOB NOT NULL, crc32 INTEGER NOT NULL)"},
    {"vlads", "CREATE TABLE vlads(image INTEGER PRIMARY KEY, descriptor BLOB NOT NULL, crc32 INTEGER NOT NULL)"},
    {"vocabulary", "CREATE TABLE vocabulary(id INTEGER PRIMARY KEY, learnt BLOB NOT NULL)"},
}};

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
/// another map that was copied over an open one.
std::int64_t rowSeed(const ImageRow& image);

/// Those of all images.
std::vector<std::uint32_t> rowSeeds(const TrainingPoses& poses);

/// CRC-32 of a row of a wide table: its blobs, continuing from rowSeed().
std::int64_t rowChecksum(std::int64_t seed, std::initializer_list<sqlite::Bytes> blobs);

/// One bit a pixel, row by row, the first pixel in the highest bit; the last byte is filled up with zeros.
std::vector<std::uint8_t> packMask(const Mask& mask);
/// Inverse of packMask(). Throws std::runtime_error unless there are as many bytes as `size` needs.
Mask unpackMask(sqlite::Bytes bytes, const cv::Size& size);

/// Four little-endian 32-bit floats a keypoint: x, y, size, angle.
std::vector<std::uint8_t> packKeypoints(const Keypoints& keypoints);
/// Inverse of packKeypoints(). Throws std::runtime_error when a value is not finite.
Keypoints unpackKeypoints(sqlite::Bytes bytes);

/// 128 little-endian 32-bit floats.
std::vector<std::uint8_t> packHistogram(const GlobalFeatures::Histogram& histogram);
/// Inverse of packHistogram(). Throws std::runtime_error when the size is wrong or a value is not finite or negative.
GlobalFeatures::Histogram unpackHistogram(sqlite::Bytes bytes);

/// What a vocabulary has learnt: its numbers of components and axes (16 bits each), words, components, mean and scales
/// (32-bit floats) and axes (bytes), all little-endian and column by column.
std::vector<std::uint8_t> packVocabulary(const VladVocabulary& vocabulary);
/// Inverse of packVocabulary() for local features of this dimension. Throws std::runtime_error or
/// std::invalid_argument when a size is wrong or a number not finite.
std::shared_ptr<const VladVocabulary> unpackVocabulary(sqlite::Bytes bytes, std::size_t dimension, cv::Size image_size);

/// The header as rows of the table `meta`, without the checksum. Of a mask they hold the checksum of its bits, of the
/// table of landmarks the number of its rows: to count them all of it would have to be read.
ParameterValues toMeta(const MapHeader& header, std::size_t geometry_count);
/// Removes from `meta` how many images have a geometry, and returns it. Throws
/// std::runtime_error when it is missing or not in [0, kMaxImages].
std::size_t takeGeometryCount(ParameterValues& meta);
/// Masks as they are stored, by the number of their session.
using MaskBits = std::map<std::int64_t, std::vector<std::uint8_t>>;
/// Inverse of toMeta(), but for what takeGeometryCount() takes. Throws std::runtime_error
/// when a value, a mask or the vocabulary is missing, unknown, of the wrong type or out of range, and when a mask or
/// the vocabulary does not agree with its checksum. `vocabulary`: as it is stored, empty without one.
MapHeader toHeader(ParameterValues meta, const MaskBits& masks, const std::vector<std::uint8_t>& vocabulary);

// Geometry as bytes, in one order on every machine.

template <class Unsigned>
void putLittleEndian(Unsigned value, std::uint8_t* to) {
  for (std::size_t i = 0; i < sizeof(value); ++i) to[i] = static_cast<std::uint8_t>(value >> (8 * i));
}

template <class Unsigned>
Unsigned getLittleEndian(const std::uint8_t* from) {
  Unsigned value = 0;
  for (std::size_t i = 0; i < sizeof(value); ++i) value = static_cast<Unsigned>(value | Unsigned{from[i]} << (8 * i));
  return value;
}

/// The bits of a float or a double.
template <class Real>
using RealBits = std::conditional_t<sizeof(Real) == sizeof(std::uint32_t), std::uint32_t, std::uint64_t>;

template <class Real>
void putReal(Real value, std::uint8_t* to) {
  RealBits<Real> bits = 0;
  static_assert(sizeof(bits) == sizeof(value));
  std::memcpy(&bits, &value, sizeof(bits));
  putLittleEndian(bits, to);
}

template <class Real>
Real getReal(const std::uint8_t* from) {
  const auto bits = getLittleEndian<RealBits<Real>>(from);
  Real value = 0;
  std::memcpy(&value, &bits, sizeof(value));
  return value;
}

/// Position (3 doubles), rotation (w, x, y, z; 4 doubles), upper triangle of the covariance row by row (21 floats).
constexpr std::size_t kPoseBytes = 3 * 8 + 4 * 8 + 21 * 4;
/// Up to this number of features their indices take two bytes, beyond it four.
constexpr std::size_t kMostShortIndices = 65536;

/// Bytes of a landmark in an image of so many features: 20, or 22 beyond kMostShortIndices.
constexpr std::size_t landmarkBytes(std::size_t feature_count) {
  return (feature_count <= kMostShortIndices ? 2 : 4) + 4 + 3 * 4 + 2;
}

/// The blobs of a row of the table `landmarks`; all numbers are little-endian.
struct PackedGeometry {
  std::vector<std::uint8_t> pose;    ///< kPoseBytes
  std::vector<std::uint8_t> points;  ///< landmarkBytes() each: feature, id, offset (3 floats), classes of the sigmas
};

/// `feature_count`: SIFT features of the image. Throws std::runtime_error when the geometry is not usable, as it is or
/// with its covariance rounded to floats: what is written can be read.
PackedGeometry packGeometry(const ImageGeometry& geometry, std::size_t feature_count);
/// Inverse of packGeometry(), but for the rounding of covariance and sigmas. Throws std::runtime_error when a size is
/// wrong or the geometry not usable (see requireUsable).
ImageGeometry unpackGeometry(sqlite::Bytes pose, sqlite::Bytes points, std::size_t feature_count);

/// Class of a standard deviation in metres: the smallest whose sigma is not below it, at most 255.
std::uint8_t sigmaClass(float sigma_m);
/// 1 mm * 1.05^class: from 1 mm to 253 m, at most 5 % too large.
float sigmaOf(std::uint8_t sigma_class);

}  // namespace visual_localization::map_schema

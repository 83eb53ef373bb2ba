#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "map/map_schema.h"
#include "visual_localization/features/global_features.h"
#include "visual_localization/features/sift_features.h"
#include "visual_localization/geometry/image_geometry.h"

/// Geometry as bytes, in one order on every machine.
namespace visual_localization::map_schema {

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

inline void putFloat(float value, std::uint8_t* to) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof(bits));
  putLittleEndian(bits, to);
}

inline float getFloat(const std::uint8_t* from) {
  const auto bits = getLittleEndian<std::uint32_t>(from);
  float value = 0.0F;
  std::memcpy(&value, &bits, sizeof(value));
  return value;
}

inline void putDouble(double value, std::uint8_t* to) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof(bits));
  putLittleEndian(bits, to);
}

inline double getDouble(const std::uint8_t* from) {
  const auto bits = getLittleEndian<std::uint64_t>(from);
  double value = 0.0;
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

/// The parts of reading a map file that the whole map and a single image share.
namespace visual_localization::map_rows {

/// Why a map is refused, without the path.
class Refusal : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// "image 7"
std::string imageName(std::int64_t id);

/// Size in bytes of the regular file at `path`. Throws Refusal.
std::int64_t fileSize(const std::string& path);

/// An open map file.
struct MapDatabase {
  sqlite::Database database;
  int version = 0;  ///< of its schema
};

/// Opens what is a complete map of a version that we know, without any schema but that. Throws Refusal or
/// sqlite::Error.
MapDatabase open(const std::string& path, std::int64_t size);

/// What may be read of a file: no more than it has. Rows of a damaged one may claim the same bytes again and again.
class Budget {
 public:
  explicit Budget(std::int64_t file_size) : left_(static_cast<std::uint64_t>(file_size)) {}
  /// Throws Refusal.
  void spend(std::uint64_t bytes);

 private:
  std::uint64_t left_;
};

/// Statements that read the wide tables; the column of the image comes first.
constexpr const char* kSelectSift = "SELECT image, keypoints, descriptors, crc32 FROM features";
constexpr const char* kSelectGlobal = "SELECT image, wgoh, wgii, crc32 FROM globals";
constexpr const char* kSelectPreview = "SELECT image, jpeg, crc32 FROM previews";
/// Since kSinceLandmarks; an image without geometry has no row.
constexpr const char* kSelectGeometry = "SELECT image, pose, points, crc32 FROM landmarks";

// What is in the current row of such a statement. Each throws Refusal when it does not agree with its checksum, which
// begins with `seed` (map_schema::rowSeed), and sqlite::Error or std::exception when it is not even of the right form.
/// Throws Refusal, too, when they are not `count`: what the table of images says, and others rely on.
SiftFeatures siftOf(const sqlite::Statement& row, std::int64_t seed, std::size_t count);
GlobalFeatures globalOf(const sqlite::Statement& row, std::int64_t seed);
std::vector<std::uint8_t> previewOf(const sqlite::Statement& row, std::int64_t seed);
/// `feature_count`: SIFT features of the image.
ImageGeometry geometryOf(const sqlite::Statement& row, std::int64_t seed, std::size_t feature_count);

}  // namespace visual_localization::map_rows

#pragma once

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "map/map_schema.h"
#include "map/sqlite.h"
#include "visual_localization/features/global_features.h"
#include "visual_localization/features/local_feature_kind.h"
#include "visual_localization/features/local_features.h"
#include "visual_localization/features/vlad.h"
#include "visual_localization/geometry/image_geometry.h"

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

/// Opens what is a complete map, without any schema but its own. Throws Refusal or sqlite::Error.
sqlite::Database open(const std::string& path, std::int64_t size);

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
constexpr const char* kSelectLocal = "SELECT image, keypoints, descriptors, crc32 FROM features";
constexpr const char* kSelectGlobal = "SELECT image, wgoh, wgii, crc32 FROM globals";
constexpr const char* kSelectPreview = "SELECT image, jpeg, crc32 FROM previews";
/// Without a vocabulary there is no row.
constexpr const char* kSelectVlad = "SELECT image, descriptor, crc32 FROM vlads";
/// An image without geometry has no row.
constexpr const char* kSelectGeometry = "SELECT image, pose, points, crc32 FROM landmarks";

// What is in the current row of such a statement. Each throws Refusal when it does not agree with its checksum, which
// begins with `seed` (map_schema::rowSeed), and sqlite::Error or std::exception when it is not even of the right form.
/// Throws Refusal, too, when they are not `count`: what the table of images says, and others rely on.
LocalFeatures localOf(const sqlite::Statement& row, std::int64_t seed, std::size_t count, const LocalFeatureKind& kind);
GlobalFeatures globalOf(const sqlite::Statement& row, std::int64_t seed);
/// `bytes`: of each one, by the vocabulary.
VladDescriptor vladOf(const sqlite::Statement& row, std::int64_t seed, std::size_t bytes);
std::vector<std::uint8_t> previewOf(const sqlite::Statement& row, std::int64_t seed);
/// `feature_count`: SIFT features of the image.
ImageGeometry geometryOf(const sqlite::Statement& row, std::int64_t seed, std::size_t feature_count);

}  // namespace visual_localization::map_rows

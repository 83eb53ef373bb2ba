#include <algorithm>
#include <cmath>
#include <functional>
#include <new>
#include <optional>
#include <string>
#include <utility>

#include "base/text.h"
#include "map/feature_store.h"
#include "map/map_rows.h"
#include "map/map_schema.h"
#include "map/sqlite.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization {
namespace {

using map_rows::imageName;
using map_rows::Refusal;
using map_schema::ImageRow;
using sqlite::Statement;

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

ParameterValues readMeta(const sqlite::Database& database, map_rows::Budget& budget) {
  ParameterValues meta;
  Statement row(database, "SELECT key, value FROM meta ORDER BY key");
  while (row.step()) {
    const std::string key = row.text(0);
    // The pages of a damaged tree may lead to the same rows without end.
    if (!meta.empty() && key <= meta.rbegin()->first) throw Refusal("is damaged: its meta values are not in order");
    if (meta.size() == map_schema::kMaxMetaValues) {
      throw Refusal("has more than the " + std::to_string(map_schema::kMaxMetaValues) +
                    " meta values that are allowed");
    }
    const ParameterValue value = metaValue(row);
    const auto* text = std::get_if<std::string>(&value);
    budget.spend(key.size() + (text == nullptr ? 0 : text->size()));
    meta.emplace_hint(meta.end(), key, value);
  }
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
  return image;
}

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

/// Room for what the file says it has, as long as the file can have it.
std::size_t expectedImages(const sqlite::Database& database, std::int64_t file_size) {
  constexpr std::int64_t kSmallestRow_bytes = 32;
  Statement last(database, "SELECT id FROM images ORDER BY id DESC LIMIT 1");
  if (!last.step()) return 0;
  const std::int64_t most = std::min(file_size / kSmallestRow_bytes, map_schema::kMaxImages);
  return static_cast<std::size_t>(std::clamp<std::int64_t>(last.integer(0), 0, most)) + 1;
}

/// Where the images were taken, verified row by row.
TrainingPoses readPoses(const sqlite::Database& database, std::int64_t file_size, std::size_t session_count,
                        map_schema::Checksum& checksum) {
  TrainingPoses poses;
  poses.reserve(expectedImages(database, file_size));
  Statement row(database,
                "SELECT id, session, stamp_ns, east_m, north_m, yaw_rad, feature_count FROM images ORDER BY id");
  while (row.step()) {
    const ImageRow image = imageRow(row);
    requirePlausible(image, poses.size(), session_count);
    image.addTo(checksum);
    poses.add({image.stamp_ns, static_cast<int>(image.session), {image.east_m, image.north_m}, image.yaw_rad},
              static_cast<std::size_t>(image.feature_count));
  }
  return poses;
}

/// What is read of every map when it is opened.
struct Opened {
  MapHeader header;
  TrainingPoses poses;
  std::vector<std::uint32_t> row_seeds;  ///< of each image: map_schema::rowSeed()
  std::size_t geometry_count = 0;        ///< images with a geometry
  map_rows::Budget budget;               ///< for the rest
};

map_schema::MaskBits readMasks(const sqlite::Database& map, map_rows::Budget& budget) {
  map_schema::MaskBits masks;
  Statement row(map, "SELECT session, bits FROM masks ORDER BY session");
  while (row.step()) {
    const std::int64_t session = row.integer(0);
    if (!masks.empty() && session <= masks.rbegin()->first) throw Refusal("is damaged: its masks are not in order");
    const sqlite::Bytes bits = row.blob(1);
    budget.spend(sizeof(session) + bits.size);
    masks[session].assign(bits.data, bits.data + bits.size);
  }
  return masks;
}

/// As it is stored; empty: there is none.
std::vector<std::uint8_t> readVocabulary(const sqlite::Database& map, map_rows::Budget& budget) {
  Statement row(map, "SELECT id, learnt FROM vocabulary");
  if (!row.step()) return {};
  const sqlite::Bytes learnt = row.blob(1);
  budget.spend(learnt.size);
  std::vector<std::uint8_t> bytes(learnt.data, learnt.data + learnt.size);
  if (row.integer(0) != 0 || bytes.empty() || row.step()) throw Refusal("is damaged: its vocabulary is not one");
  return bytes;
}

Opened readPosesAndHeader(const sqlite::Database& map, std::int64_t file_size) {
  map_rows::Budget budget(file_size);
  ParameterValues meta = readMeta(map, budget);
  const std::int64_t expected = takeChecksum(meta);
  map_schema::Checksum checksum;
  ParameterValues of_header = meta;
  const std::size_t geometry_count = map_schema::takeGeometryCount(of_header);
  MapHeader header = map_schema::toHeader(std::move(of_header), readMasks(map, budget), readVocabulary(map, budget));
  Opened opened{std::move(header), {}, {}, geometry_count, budget};
  opened.poses = readPoses(map, file_size, opened.header.sessions.size(), checksum);
  opened.row_seeds = map_schema::rowSeeds(opened.poses);
  checksum.add(meta);
  if (checksum.value() != expected) throw Refusal("is damaged: its content does not agree with its checksum");
  if (geometry_count > opened.poses.size()) throw Refusal("is damaged: more images have landmarks than there are");
  return opened;
}

/// Goes to the row of the image that is next.
void stepTo(std::size_t image, Statement& row, const char* what) {
  const auto id = static_cast<std::int64_t>(image);
  if (!row.step() || row.integer(0) != id) {
    throw Refusal(std::string("is damaged: ") + what + " of " + imageName(id) + " are missing");
  }
}

/// The rows of the landmarks, while the images pass by in their order.
class GeometryRows {
 public:
  explicit GeometryRows(const sqlite::Database& map)
      : row_(map, map_rows::kSelectGeometry + std::string(" ORDER BY image")), has_row_(row_.step()) {}

  std::optional<ImageGeometry> of(std::size_t image, std::int64_t seed, std::size_t feature_count) {
    if (!has_row_ || row_.integer(0) != static_cast<std::int64_t>(image)) return std::nullopt;
    std::optional<ImageGeometry> geometry = map_rows::geometryOf(row_, seed, feature_count);
    ++found_;
    has_row_ = row_.step();
    return geometry;
  }

  /// After the last image. Throws Refusal unless that were all rows, and as many as expected.
  void requireEnd(std::size_t expected) const {
    if (has_row_) throw Refusal("is damaged: it has landmarks without an image");
    if (found_ == expected) return;
    throw Refusal("is damaged: " + std::to_string(found_) + " images have landmarks instead of " +
                  std::to_string(expected));
  }

 private:
  Statement row_;
  bool has_row_;
  std::size_t found_ = 0;
};

std::uint64_t storedBytes(const TrainingImage& image, const LocalFeatureKind& kind) {
  const std::size_t landmark_bytes = map_schema::landmarkBytes(image.local.size());
  const std::size_t of_geometry =
      image.geometry ? map_schema::kPoseBytes + image.geometry->landmarks.size() * landmark_bytes : 0;
  return of_geometry + image.local.size() * (map_schema::kKeypointBytes + kind.stored_bytes()) +
         2 * map_schema::kHistogramBytes + image.preview_jpeg.size() + image.vlad.size();
}

/// The rows of VLAD, while the images pass by in their order.
class VladRows {
 public:
  /// `bytes`: of each row; 0: there are none.
  VladRows(const sqlite::Database& map, std::size_t bytes)
      : bytes_(bytes), row_(map, map_rows::kSelectVlad + std::string(" ORDER BY image")) {}

  VladDescriptor of(std::size_t image, std::int64_t seed) {
    if (bytes_ == 0) return {};
    stepTo(image, row_, "bytes of the VLAD");
    return map_rows::vladOf(row_, seed, bytes_);
  }

  /// After the last image.
  void requireEnd() {
    if (row_.step()) throw Refusal("is damaged: it has VLAD without an image or a vocabulary");
  }

 private:
  std::size_t bytes_;
  Statement row_;
};

/// Reads and verifies what all images looked like, one after the other.
void forEachImage(const sqlite::Database& map, Opened& opened, const std::function<void(TrainingImage&&)>& use) {
  const TrainingPoses& poses = opened.poses;
  const std::string in_order = " ORDER BY image";
  const LocalFeatureKind& kind = *opened.header.kind;
  Statement local(map, map_rows::kSelectLocal + in_order);
  Statement global(map, map_rows::kSelectGlobal + in_order);
  Statement preview(map, map_rows::kSelectPreview + in_order);
  GeometryRows geometry(map);
  VladRows vlads(map, opened.header.vocabulary ? opened.header.vocabulary->bytes() : 0);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    stepTo(i, local, "features");
    stepTo(i, global, "global features");
    stepTo(i, preview, "bytes of the preview");
    const std::int64_t seed = opened.row_seeds[i];
    TrainingImage image{{poses.stamps_ns[i], poses.sessions[i], poses.positions_m[i], poses.yaws_rad[i]},
                        map_rows::localOf(local, seed, poses.feature_counts[i], kind),
                        map_rows::globalOf(global, seed),
                        map_rows::previewOf(preview, seed),
                        geometry.of(i, seed, poses.feature_counts[i]),
                        vlads.of(i, seed)};
    opened.budget.spend(storedBytes(image, kind));
    use(std::move(image));
  }
  if (local.step() || global.step() || preview.step()) {
    throw Refusal("is damaged: it has features or previews without an image");
  }
  geometry.requireEnd(opened.geometry_count);
  vlads.requireEnd();
}

std::shared_ptr<const TrainingMap> readWhole(const sqlite::Database& map, Opened opened) {
  std::vector<TrainingImage> images;
  images.reserve(opened.poses.size());
  forEachImage(map, opened, [&images](TrainingImage&& image) { images.push_back(std::move(image)); });
  return std::make_shared<const TrainingMap>(std::move(opened.header), std::move(images));
}

void requireIntegrity(const sqlite::Database& database) {
  Statement check(database, "PRAGMA integrity_check(1)");
  if (!check.step()) throw Refusal("is damaged: its structure cannot be checked");
  if (const std::string answer = check.text(0); answer != "ok") throw Refusal("is damaged: " + answer);
}

/// Runs `read` on the opened file and puts the path in front of whatever it throws.
template <class Read>
auto withMapFile(const std::string& path, Read read) {
  try {
    const std::int64_t size = map_rows::fileSize(path);
    return read(map_rows::open(path, size), size);
  } catch (const Refusal& refusal) {
    throw MapStoreError(path + ": " + oneLine(refusal.what()));
  } catch (const sqlite::OpenError& error) {
    throw MapStoreError(path + ": cannot be opened: " + oneLine(error.what()));
  } catch (const std::bad_alloc&) {
    throw MapStoreError(path + ": there is not enough memory for this map");
  } catch (const std::exception& error) {
    throw MapStoreError(path + ": is damaged: " + oneLine(error.what()));
  }
}

}  // namespace

std::shared_ptr<const TrainingMap> loadMap(const std::string& path, const MapLoading& loading) {
  return withMapFile(path, [&](sqlite::Database&& map, std::int64_t size) {
    Opened opened = readPosesAndHeader(map, size);
    if (static_cast<std::uint64_t>(size) <= loading.cache_bytes) return readWhole(map, std::move(opened));
    StoredRows rows{opened.poses.feature_counts, std::move(opened.row_seeds), opened.geometry_count, opened.header.kind,
                    opened.header.vocabulary ? opened.header.vocabulary->bytes() : 0};
    auto store =
        std::make_unique<FileFeatureStore>(std::move(map), path, std::move(rows), loading.cache_bytes, loading.warn);
    return std::make_shared<const TrainingMap>(std::move(opened.header), std::move(opened.poses), std::move(store));
  });
}

void checkMap(const std::string& path) {
  withMapFile(path, [](const sqlite::Database& file, std::int64_t size) {
    Opened opened = readPosesAndHeader(file, size);
    forEachImage(file, opened, [](TrainingImage&&) {});
    requireIntegrity(file);
    // What a map may not be besides.
    const TrainingMap map(std::move(opened.header), std::move(opened.poses),
                          std::make_unique<MemoryFeatureStore>(std::vector<TrainingImage>()));
  });
}

std::string packageVersionOf(const std::string& path) {
  return withMapFile(path, [](const sqlite::Database& map, std::int64_t size) {
    map_rows::Budget budget(size);
    const ParameterValues meta = readMeta(map, budget);
    const auto found = meta.find("package_version");
    if (found == meta.end()) throw Refusal("is damaged: it has no package version");
    return oneLine(parameters::toString(found->second));
  });
}

}  // namespace visual_localization

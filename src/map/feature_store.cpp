#include "map/feature_store.h"

#include <exception>
#include <utility>

#include "base/text.h"
#include "map/map_rows.h"

namespace visual_localization {
namespace {

constexpr const char* kOfOneImage = " WHERE image = ?";

std::size_t bytesOf(const LocalFeatures& features) { return features.memory_bytes(); }

std::size_t bytesOf(const GlobalFeatures&) { return sizeof(GlobalFeatures); }

std::size_t bytesOf(const VladDescriptor& vlad) { return sizeof(vlad) + vlad.capacity(); }

std::size_t bytesOf(const std::optional<ImageGeometry>& geometry) {
  return sizeof(geometry) + (geometry ? geometry->landmarks.capacity() * sizeof(SeenLandmark) : 0);
}

/// What is kept of an image, by the number of its key.
enum Kind : std::uint64_t { kLocal, kGlobal, kGeometry, kVlad, kKinds };

std::uint64_t keyOf(std::size_t image, Kind kind) { return kKinds * image + kind; }

}  // namespace

MemoryFeatureStore::MemoryFeatureStore(std::vector<TrainingImage>&& images) {
  local_.reserve(images.size());
  global_.reserve(images.size());
  vlads_.reserve(images.size());
  previews_.reserve(images.size());
  geometry_.resize(images.size());
  for (TrainingImage& image : images) {
    local_.push_back(std::move(image.local));
    global_.push_back(image.global);
    vlads_.push_back(std::move(image.vlad));
    previews_.push_back(std::move(image.preview_jpeg));
    if (!image.geometry) continue;
    geometry_[previews_.size() - 1] = std::make_unique<const ImageGeometry>(std::move(*image.geometry));
    ++geometry_count_;
  }
}

FileFeatureStore::FileFeatureStore(sqlite::Database database, std::string path, StoredRows stored,
                                   std::size_t cache_bytes, Warn warn)
    : path_(std::move(path)),
      stored_(std::move(stored)),
      cache_bytes_(cache_bytes),
      warn_(std::move(warn)),
      database_(std::move(database)),
      local_rows_(database_, std::string(map_rows::kSelectLocal) + kOfOneImage),
      global_rows_(database_, std::string(map_rows::kSelectGlobal) + kOfOneImage),
      preview_rows_(database_, std::string(map_rows::kSelectPreview) + kOfOneImage),
      cache_(cache_bytes) {
  if (stored_.geometry_count > 0)
    geometry_rows_.emplace(database_, std::string(map_rows::kSelectGeometry) + kOfOneImage);
  if (stored_.vlad_bytes > 0) vlad_rows_.emplace(database_, std::string(map_rows::kSelectVlad) + kOfOneImage);
}

std::shared_ptr<const LocalFeatures> FileFeatureStore::local(std::size_t image) const {
  return get<LocalFeatures>(keyOf(image, kLocal), [&] {
    return read(image, local_rows_, "features", [&](const sqlite::Statement& row) {
      return map_rows::localOf(row, stored_.seeds[image], stored_.feature_counts[image], *stored_.kind);
    });
  });
}

std::shared_ptr<const GlobalFeatures> FileFeatureStore::global(std::size_t image) const {
  return get<GlobalFeatures>(keyOf(image, kGlobal), [&] {
    return read(image, global_rows_, "global features",
                [&](const sqlite::Statement& row) { return map_rows::globalOf(row, stored_.seeds[image]); });
  });
}

std::shared_ptr<const VladDescriptor> FileFeatureStore::vlad(std::size_t image) const {
  return get<VladDescriptor>(keyOf(image, kVlad), [&] {
    if (!vlad_rows_) return VladDescriptor();
    return read(image, *vlad_rows_, "VLAD", [&](const sqlite::Statement& row) {
      return map_rows::vladOf(row, stored_.seeds[image], stored_.vlad_bytes);
    });
  });
}

std::vector<std::uint8_t> FileFeatureStore::preview(std::size_t image) const {
  const std::lock_guard<std::mutex> lock(reading_);
  return read(image, preview_rows_, "preview",
              [&](const sqlite::Statement& row) { return map_rows::previewOf(row, stored_.seeds[image]); });
}

std::shared_ptr<const ImageGeometry> FileFeatureStore::geometry(std::size_t image) const {
  if (!geometry_rows_) return nullptr;
  // That an image has none is kept as well.
  const auto kept = get<std::optional<ImageGeometry>>(keyOf(image, kGeometry), [&] { return readGeometry(image); });
  if (!*kept) return nullptr;
  return {kept, &**kept};
}

std::optional<ImageGeometry> FileFeatureStore::readGeometry(std::size_t image) const {
  const auto decode = [&](const sqlite::Statement& row) {
    return std::optional<ImageGeometry>(map_rows::geometryOf(row, stored_.seeds[image], stored_.feature_counts[image]));
  };
  return read(image, *geometry_rows_, "landmarks", decode, true);
}

std::size_t FileFeatureStore::globalsKept() const {
  return cache_bytes_ / 2 / (sizeof(GlobalFeatures) + FeatureCache<void>::kBookkeeping_bytes);
}

template <class T, class Read>
std::shared_ptr<const T> FileFeatureStore::get(std::uint64_t key, Read readIt) const {
  if (auto kept = find(key)) return std::static_pointer_cast<const T>(kept);
  const std::lock_guard<std::mutex> lock(reading_);
  // Another thread may have read it in the meantime.
  if (auto kept = find(key)) return std::static_pointer_cast<const T>(kept);
  const auto value = std::make_shared<const T>(readIt());
  const std::lock_guard<std::mutex> keeping(keeping_);
  cache_.add(key, value, bytesOf(*value));
  return value;
}

std::shared_ptr<const void> FileFeatureStore::find(std::uint64_t key) const {
  const std::lock_guard<std::mutex> lock(keeping_);
  return cache_.find(key);
}

template <class Decode>
auto FileFeatureStore::read(std::size_t image, sqlite::Statement& row, const char* what, Decode decode,
                            bool may_be_missing) const -> decltype(decode(row)) {
  try {
    row.reset();
    row.bind(0, static_cast<std::int64_t>(image));
    decltype(decode(row)) value{};
    if (row.step()) {
      value = decode(row);
    } else if (!may_be_missing) {
      throw map_rows::Refusal("they are missing");
    }
    row.reset();
    return value;
  } catch (const std::exception& error) {
    row.reset();
    warnOnce(image, what, error.what());
    return {};
  }
}

void FileFeatureStore::warnOnce(std::size_t image, const char* what, const std::string& reason) const {
  if (std::exchange(warned_, true) || !warn_) return;
  warn_(path_ + ": " + what + " of " + map_rows::imageName(static_cast<std::int64_t>(image)) +
        " cannot be used: " + oneLine(reason) + "; it counts as without " + what +
        ", and what else cannot be read from now on does so without a word");
}

}  // namespace visual_localization

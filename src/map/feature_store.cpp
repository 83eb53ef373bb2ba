#include "map/feature_store.h"

#include <exception>
#include <utility>

#include "base/text.h"
#include "map/map_rows.h"

namespace visual_localization {
namespace {

constexpr const char* kOfOneImage = " WHERE image = ?";

std::size_t bytesOf(const SiftFeatures& features) {
  return sizeof(SiftFeatures) +
         features.size() * (sizeof(SiftKeypoint) + SiftFeatures::kDescriptorSize + sizeof(float));
}

std::size_t bytesOf(const GlobalFeatures&) { return sizeof(GlobalFeatures); }

}  // namespace

MemoryFeatureStore::MemoryFeatureStore(std::vector<TrainingImage>&& images) {
  sift_.reserve(images.size());
  global_.reserve(images.size());
  previews_.reserve(images.size());
  for (TrainingImage& image : images) {
    sift_.push_back(std::move(image.sift));
    global_.push_back(image.global);
    previews_.push_back(std::move(image.preview_jpeg));
  }
}

FileFeatureStore::FileFeatureStore(sqlite::Database database, std::string path,
                                   std::vector<std::uint32_t> feature_counts, std::size_t cache_bytes, Warn warn)
    : path_(std::move(path)),
      feature_counts_(std::move(feature_counts)),
      cache_bytes_(cache_bytes),
      warn_(std::move(warn)),
      database_(std::move(database)),
      sift_rows_(database_, std::string(map_rows::kSelectSift) + kOfOneImage),
      global_rows_(database_, std::string(map_rows::kSelectGlobal) + kOfOneImage),
      preview_rows_(database_, std::string(map_rows::kSelectPreview) + kOfOneImage),
      cache_(cache_bytes) {}

std::shared_ptr<const SiftFeatures> FileFeatureStore::sift(std::size_t image) const {
  return get<SiftFeatures>(2 * image, [&] {
    return read(image, sift_rows_, "features",
                [&](const sqlite::Statement& row) { return map_rows::siftOf(row, feature_counts_[image]); });
  });
}

std::shared_ptr<const GlobalFeatures> FileFeatureStore::global(std::size_t image) const {
  return get<GlobalFeatures>(2 * image + 1,
                             [&] { return read(image, global_rows_, "global features", map_rows::globalOf); });
}

std::vector<std::uint8_t> FileFeatureStore::preview(std::size_t image) const {
  const std::lock_guard<std::mutex> lock(reading_);
  return read(image, preview_rows_, "preview", map_rows::previewOf);
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
auto FileFeatureStore::read(std::size_t image, sqlite::Statement& row, const char* what, Decode decode) const
    -> decltype(decode(row)) {
  try {
    row.reset();
    row.bind(0, static_cast<std::int64_t>(image));
    if (!row.step()) throw map_rows::Refusal("they are missing");
    auto value = decode(row);
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
        " cannot be used: " + oneLine(reason) +
        "; it counts as without features, and so does any other such image from now on without a word");
}

}  // namespace visual_localization

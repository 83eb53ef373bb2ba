#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "map/sqlite.h"
#include "visual_localization/features/global_features.h"
#include "visual_localization/features/local_feature_kind.h"
#include "visual_localization/features/local_features.h"
#include "visual_localization/features/sift.h"
#include "visual_localization/features/vlad.h"
#include "visual_localization/geometry/image_geometry.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// What the images of a map looked like: all of it in memory, or read from the map's file when it is first needed.
/// For several threads at once. What it hands out stays valid as long as the pointer to it and the store live.
class FeatureStore {
 public:
  virtual ~FeatureStore() = default;
  /// SIFT features of a training image, after pruning; never null. `image` is below the size of the map.
  virtual std::shared_ptr<const LocalFeatures> local(std::size_t image) const = 0;
  /// Global features of a training image; never null.
  virtual std::shared_ptr<const GlobalFeatures> global(std::size_t image) const = 0;
  /// VLAD of a training image; never null, empty in a map without a vocabulary.
  virtual std::shared_ptr<const VladDescriptor> vlad(std::size_t image) const = 0;
  /// Small grey JPEG for people; may be empty.
  virtual std::vector<std::uint8_t> preview(std::size_t image) const = 0;
  /// Camera's pose and landmarks; null when there are none.
  virtual std::shared_ptr<const ImageGeometry> geometry(std::size_t image) const = 0;
  /// How many images have a geometry, without reading it.
  virtual std::size_t geometryCount() const = 0;
  /// How many images' global features can be in memory at a time, with room for SIFT features beside them; more than
  /// any map has when all of them are.
  virtual std::size_t globalsKept() const = 0;
};

/// Everything in memory: nothing is locked, counted or copied.
class MemoryFeatureStore final : public FeatureStore {
 public:
  /// Takes what the images looked like; of `images` only the poses are left.
  explicit MemoryFeatureStore(std::vector<TrainingImage>&& images);

  std::shared_ptr<const LocalFeatures> local(std::size_t image) const override { return unowned(local_[image]); }
  std::shared_ptr<const GlobalFeatures> global(std::size_t image) const override { return unowned(global_[image]); }
  std::shared_ptr<const VladDescriptor> vlad(std::size_t image) const override { return unowned(vlads_[image]); }
  std::vector<std::uint8_t> preview(std::size_t image) const override { return previews_[image]; }
  std::shared_ptr<const ImageGeometry> geometry(std::size_t image) const override {
    return geometry_[image] ? unowned(*geometry_[image]) : nullptr;
  }
  std::size_t geometryCount() const override { return geometry_count_; }
  std::size_t globalsKept() const override { return std::numeric_limits<std::size_t>::max(); }

 private:
  /// A pointer that owns nothing, for what lives as long as the store: no count that threads would contend for.
  template <class T>
  static std::shared_ptr<const T> unowned(const T& value) {
    return {std::shared_ptr<const T>(), &value};
  }

  std::vector<LocalFeatures> local_;
  std::vector<GlobalFeatures> global_;
  std::vector<VladDescriptor> vlads_;
  std::vector<std::vector<std::uint8_t>> previews_;
  std::vector<std::unique_ptr<const ImageGeometry>> geometry_;  ///< null where there is none
  std::size_t geometry_count_ = 0;
};

/// Keeps what was used last, up to a number of bytes. Not thread-safe. `T`: what is kept; never null.
template <class T>
class FeatureCache {
 public:
  using Pointer = std::shared_ptr<const T>;
  /// What a value costs besides: nodes of two containers, and the heap's own bookkeeping.
  static constexpr std::size_t kBookkeeping_bytes = 256;

  explicit FeatureCache(std::size_t limit_bytes) : limit_bytes_(limit_bytes) {}

  /// Null when it is not kept (any more).
  Pointer find(std::uint64_t key) {
    const auto found = entry_of_.find(key);
    if (found == entry_of_.end()) return nullptr;
    entries_.splice(entries_.begin(), entries_, found->second);
    return found->second->value;
  }

  /// Keeps `value`, that takes `bytes`, instead of what was used longest ago. One that is larger than the limit
  /// or is kept already changes nothing.
  void add(std::uint64_t key, Pointer value, std::size_t bytes) {
    bytes += kBookkeeping_bytes;
    if (bytes > limit_bytes_ || entry_of_.count(key) != 0) return;
    while (used_bytes_ > limit_bytes_ - bytes) {
      used_bytes_ -= entries_.back().bytes;
      entry_of_.erase(entries_.back().key);
      entries_.pop_back();
    }
    entries_.push_front({key, std::move(value), bytes});
    entry_of_.emplace(key, entries_.begin());
    used_bytes_ += bytes;
  }

  std::size_t size() const { return entries_.size(); }
  std::size_t used_bytes() const { return used_bytes_; }

 private:
  struct Entry {
    std::uint64_t key;
    Pointer value;
    std::size_t bytes;
  };
  std::size_t limit_bytes_;
  std::size_t used_bytes_ = 0;
  std::list<Entry> entries_;  ///< the one used last first
  std::unordered_map<std::uint64_t, typename std::list<Entry>::iterator> entry_of_;
};

/// What is known of a map's images without reading what they looked like.
struct StoredRows {
  std::vector<std::uint32_t> feature_counts;                                ///< of each image
  std::vector<std::uint32_t> seeds;                                         ///< of its checksums: map_schema::rowSeed()
  std::size_t geometry_count = 0;                                           ///< images that have one
  std::shared_ptr<const LocalFeatureKind> kind = std::make_shared<Sift>();  ///< of the local features
  std::size_t vlad_bytes = 0;                                               ///< of each image; 0: no vocabulary
};

/// Reads what an image looked like from the map's file when it is first needed, verifies it, and keeps what was used
/// last. What cannot be read, does not agree with its checksum or has another number of features than the map says
/// counts as without features or geometry: the file may be damaged, cut or overwritten, by another map too, at any
/// time. For several threads at once; one of them reads at a time.
class FileFeatureStore final : public FeatureStore {
 public:
  /// Called with one line about the first image that cannot be read, by the thread that needs it; never again.
  using Warn = std::function<void(const std::string&)>;

  /// `path`: to be named in the warning. `cache_bytes`: what may be kept; 0 keeps nothing.
  FileFeatureStore(sqlite::Database database, std::string path, StoredRows stored, std::size_t cache_bytes, Warn warn);

  std::shared_ptr<const LocalFeatures> local(std::size_t image) const override;
  std::shared_ptr<const GlobalFeatures> global(std::size_t image) const override;
  std::shared_ptr<const VladDescriptor> vlad(std::size_t image) const override;
  std::vector<std::uint8_t> preview(std::size_t image) const override;
  std::shared_ptr<const ImageGeometry> geometry(std::size_t image) const override;
  std::size_t geometryCount() const override { return stored_.geometry_count; }
  std::size_t globalsKept() const override;

 private:
  std::optional<ImageGeometry> readGeometry(std::size_t image) const;
  template <class T, class Read>
  std::shared_ptr<const T> get(std::uint64_t key, Read readIt) const;
  std::shared_ptr<const void> find(std::uint64_t key) const;
  template <class Decode>
  auto read(std::size_t image, sqlite::Statement& row, const char* what, Decode decode,
            bool may_be_missing = false) const -> decltype(decode(row));
  void warnOnce(std::size_t image, const char* what, const std::string& reason) const;

  const std::string path_;
  const StoredRows stored_;
  const std::size_t cache_bytes_;
  const Warn warn_;
  mutable std::mutex reading_;  ///< held while the file is read
  sqlite::Database database_;
  mutable sqlite::Statement local_rows_;
  mutable sqlite::Statement global_rows_;
  mutable sqlite::Statement preview_rows_;
  mutable std::optional<sqlite::Statement> geometry_rows_;  ///< none where there is nothing to read
  mutable std::optional<sqlite::Statement> vlad_rows_;      ///< likewise
  mutable bool warned_ = false;

  mutable std::mutex keeping_;  ///< held while the cache is touched, never while the file is read
  mutable FeatureCache<void> cache_;
};

}  // namespace visual_localization

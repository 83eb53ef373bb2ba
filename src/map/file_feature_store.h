#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "visual_localization/map/feature_cache.h"
#include "visual_localization/map/feature_store.h"
#include "visual_localization/map/sqlite.h"

namespace visual_localization {

/// Reads what an image looked like from the map's file when it is first needed, verifies it, and keeps what was used
/// last. What cannot be read, does not agree with its checksum or has another number of features than its place counts
/// as without features: the file may be damaged, cut or overwritten at any time. For several threads at once; one of
/// them reads at a time.
class FileFeatureStore final : public FeatureStore {
 public:
  /// Called with one line about the first image that cannot be read, by the thread that needs it; never again.
  using Warn = std::function<void(const std::string&)>;

  /// `path`: to be named in the warning. `feature_counts`: of the images' places. `cache_bytes`: what may be kept; 0
  /// keeps nothing.
  FileFeatureStore(sqlite::Database database, std::string path, std::vector<std::uint32_t> feature_counts,
                   std::size_t cache_bytes, Warn warn);

  std::shared_ptr<const SiftFeatures> sift(std::size_t image) const override;
  std::shared_ptr<const GlobalFeatures> global(std::size_t image) const override;
  std::vector<std::uint8_t> preview(std::size_t image) const override;
  std::size_t globalsKept() const override;

 private:
  template <class T, class Read>
  std::shared_ptr<const T> get(std::uint64_t key, Read readIt) const;
  std::shared_ptr<const void> find(std::uint64_t key) const;
  template <class Decode>
  auto read(std::size_t image, sqlite::Statement& row, const char* what, Decode decode) const -> decltype(decode(row));
  void warnOnce(std::size_t image, const char* what, const std::string& reason) const;

  const std::string path_;
  const std::vector<std::uint32_t> feature_counts_;
  const std::size_t cache_bytes_;
  const Warn warn_;
  mutable std::mutex reading_;  ///< held while the file is read
  sqlite::Database database_;
  mutable sqlite::Statement sift_rows_;
  mutable sqlite::Statement global_rows_;
  mutable sqlite::Statement preview_rows_;
  mutable bool warned_ = false;

  mutable std::mutex keeping_;  ///< held while the cache is touched, never while the file is read
  mutable FeatureCache<void> cache_;
};

}  // namespace visual_localization

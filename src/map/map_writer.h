#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "visual_localization/features/local_feature_kind.h"
#include "visual_localization/features/sift.h"
#include "visual_localization/map/map_file.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

class PartialFile;

/// For a map that is copied image by image: an image that cannot be read is no image without features, since the copy
/// would be wrong without a word. It throws MapStoreError.
MapLoading strictLoading(std::size_t cache_bytes);

/// Writes a map image by image, so that it need not fit into memory; only the poses are kept until the end. One SQLite
/// file, filled in one transaction under a temporary name beside its own: without finish() nothing has happened.
class MapWriter {
 public:
  using Kind = std::shared_ptr<const LocalFeatureKind>;
  /// `kind`: of the local features, which the header must name too. Throws MapStoreError when the file cannot be made.
  explicit MapWriter(const std::string& path, Kind kind = std::make_shared<Sift>());
  /// Into a file that stays the caller's: nothing is put in place. Throws MapStoreError.
  explicit MapWriter(const PartialFile& file, Kind kind = std::make_shared<Sift>());
  ~MapWriter();
  MapWriter(const MapWriter&) = delete;
  MapWriter& operator=(const MapWriter&) = delete;

  /// The next image. Throws MapStoreError, for instance when the disk is full or the image has too many features.
  void append(const TrainingImage& image);
  /// Puts the file in its place. To be called once. Throws MapStoreError.
  void finish(const MapHeader& header);

 private:
  class Tables;

  std::string path_;
  std::unique_ptr<PartialFile> file_;  ///< to be put in place
  std::unique_ptr<Tables> tables_;
};

}  // namespace visual_localization

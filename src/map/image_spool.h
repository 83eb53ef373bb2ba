#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/files.h"
#include "map/map_writer.h"
#include "visual_localization/map/map_file.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// Where images wait until all are known, because only then their neighbours are: in memory, or in a temporary file.
class ImageSpool {
 public:
  /// `beside`: the temporary file is made beside this one; empty: in memory. Throws FileError or MapStoreError.
  explicit ImageSpool(const std::string& beside) {
    if (beside.empty()) return;
    file_ = std::make_unique<PartialFile>(beside);
    writer_ = std::make_unique<MapWriter>(*file_);
  }

  /// Throws MapStoreError, for instance when the disk is full.
  void append(const TrainingImage& image) {
    if (writer_) {
      writer_->append(image);
    } else {
      in_memory_.push_back(image);
    }
  }

  /// All images, in their order, for as long as the spool lives. Ends it. There must be one; throws MapStoreError.
  std::shared_ptr<const TrainingMap> finish(const MapHeader& header) {
    if (!writer_) return std::make_shared<const TrainingMap>(header, std::move(in_memory_));
    writer_->finish(header);
    writer_.reset();
    return loadMap(file_->path(), strictLoading(kSpoolCache_bytes));
  }

 private:
  /// Neighbours are mostly images that were recorded shortly before and after.
  static constexpr std::size_t kSpoolCache_bytes = std::size_t{64} << 20U;

  std::vector<TrainingImage> in_memory_;
  std::unique_ptr<PartialFile> file_;
  std::unique_ptr<MapWriter> writer_;
};

}  // namespace visual_localization

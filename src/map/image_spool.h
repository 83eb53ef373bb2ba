#pragma once

#include <memory>
#include <string>
#include <vector>

#include "visual_localization/map/training_map.h"

namespace visual_localization {

class MapWriter;
class PartialFile;

/// Where images wait until all are known, because only then their neighbours are: in memory, or in a temporary file.
class ImageSpool {
 public:
  /// `beside`: the temporary file is made beside this one; empty: in memory. Throws FileError or MapStoreError.
  explicit ImageSpool(const std::string& beside);
  ~ImageSpool();

  /// Throws MapStoreError, for instance when the disk is full.
  void append(const TrainingImage& image);
  /// All images, in their order, for as long as the spool lives. Ends it. There must be one; throws MapStoreError.
  std::shared_ptr<const TrainingMap> finish(const MapHeader& header);

 private:
  std::vector<TrainingImage> in_memory_;
  std::unique_ptr<PartialFile> file_;
  std::unique_ptr<MapWriter> writer_;
};

}  // namespace visual_localization

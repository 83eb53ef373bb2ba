#include "map/image_spool.h"

#include <utility>

#include "base/files.h"
#include "map/map_writer.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization {
namespace {

/// Neighbours are mostly images that were recorded shortly before and after.
constexpr std::size_t kCache_bytes = std::size_t{64} << 20U;

}  // namespace

ImageSpool::ImageSpool(const std::string& beside) {
  if (beside.empty()) return;
  file_ = std::make_unique<PartialFile>(beside);
  writer_ = std::make_unique<MapWriter>(file_->path());
}

ImageSpool::~ImageSpool() = default;

void ImageSpool::append(const TrainingImage& image) {
  if (writer_) {
    writer_->append(image);
  } else {
    in_memory_.push_back(image);
  }
}

std::shared_ptr<const TrainingMap> ImageSpool::finish(const MapHeader& header) {
  if (!writer_) return std::make_shared<const TrainingMap>(header, std::move(in_memory_));
  writer_->finish(header);
  writer_.reset();
  // An image that cannot be read back is no image without features: the map would be wrong without a word.
  return loadMap(file_->path(), {kCache_bytes, [](const std::string& reason) { throw MapStoreError(reason); }});
}

}  // namespace visual_localization

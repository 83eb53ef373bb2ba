#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "base/files.h"
#include "map/map_geometry.h"
#include "map/map_writer.h"
#include "visual_localization/features/global_features.h"
#include "visual_localization/features/local_feature_kind.h"
#include "visual_localization/features/local_features.h"
#include "visual_localization/map/map_file.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// Where images wait until all are known, because only then their neighbours are: in memory, or in a temporary file.
class ImageSpool {
 public:
  /// `beside`: the temporary file is made beside this one; empty: in memory. Throws FileError or MapStoreError.
  ImageSpool(const std::string& beside, std::shared_ptr<const LocalFeatureKind> kind) {
    if (beside.empty()) return;
    file_ = std::make_unique<PartialFile>(beside);
    writer_ = std::make_unique<MapWriter>(*file_, std::move(kind));
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

/// Which images of an unpruned map decide what is noise in an image: the nearest ones (Weiss et al., section III) of
/// those that should show the same. That leaves out other sessions, whose light, and images that face another way,
/// whose view is another one: they would drop nearly all features. So a session is pruned as if it were alone.
class PruningNeighbours {
 public:
  /// `map` must outlive it.
  explicit PruningNeighbours(const TrainingMap& map);

  /// At most two, closest first; none when no other image shows the same.
  std::vector<std::size_t> of(std::size_t image) const;

 private:
  const TrainingMap& map_;
  SessionIndex sessions_;
};

/// An image that has its pose, but no features yet.
struct RawImage {
  TrainingPose pose;
  cv::Mat grey;    ///< 8-bit, one channel, of the map's size
  Mask mask = {};  ///< of the map's size, or empty
};

/// Makes training images of several images at once. What comes out does not depend on the number of threads.
class ExtractionPool {
 public:
  /// `model`: see LocalFeatureKind. `threads`: at least 1.
  ExtractionPool(const LocalFeatureKind& kind, const std::string& model, std::size_t threads);
  ~ExtractionPool();

  /// In the order of `images`, features not pruned. Throws like requireExtractable.
  std::vector<TrainingImage> extract(const std::vector<RawImage>& images);

 private:
  /// What one thread works with.
  struct Worker {
    std::unique_ptr<LocalExtractor> local;
    GlobalExtractor global;
    cv::Mat spread;  ///< a dull image with the usual contrast
    cv::Mat masked;  ///< that without what the mask hides
  };
  TrainingImage extract(const RawImage& image, Worker& worker) const;

  std::vector<Worker> workers_;
};

}  // namespace visual_localization

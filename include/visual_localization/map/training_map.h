#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "visual_localization/features/sift_extractor.h"
#include "visual_localization/geo/local_frame.h"
#include "visual_localization/map/feature_store.h"
#include "visual_localization/map/position_index.h"
#include "visual_localization/map/training_image.h"
#include "visual_localization/map/training_places.h"

namespace visual_localization {

/// What holds for all images of a map.
struct MapHeader {
  GeodeticPoint datum;                ///< origin of the map frame
  cv::Size image_size;                ///< pixels; live images are resized to it
  SiftConfig sift;                    ///< how features were extracted
  std::vector<std::string> sessions;  ///< names of the recorded rounds
};

/// Axis-aligned rectangle in the map frame, metres. A range may be zero (a single straight street).
struct Area {
  Eigen::Vector2d min_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d max_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d range() const { return max_m - min_m; }
};

/// The map: places of the training images in memory with a spatial index over them, and what the images looked like
/// wherever the store has it. Immutable, so that it can be shared between threads.
class TrainingMap {
 public:
  /// A map that is all in memory. Throws std::invalid_argument, in one line, when there is no image, the image size is
  /// not positive, a position or heading is not finite or a session index is out of range.
  TrainingMap(MapHeader header, std::vector<TrainingImage> images);
  /// A map whose images' looks are in `store`. Throws like the other one.
  TrainingMap(MapHeader header, TrainingPlaces places, std::unique_ptr<const FeatureStore> store);
  TrainingMap(const TrainingMap&) = delete;
  TrainingMap& operator=(const TrainingMap&) = delete;

  const MapHeader& header() const { return header_; }
  const LocalFrame& frame() const { return frame_; }
  std::size_t size() const { return places_.size(); }
  /// Bounding box of the training positions.
  const Area& area() const { return area_; }

  // Of training image `i`, which is below size().
  const Eigen::Vector2d& position_m(std::size_t i) const { return places_.positions_m[i]; }
  double yaw_rad(std::size_t i) const { return places_.yaws_rad[i]; }
  TrainingPlace place(std::size_t i) const;
  /// Number of SIFT features, without reading them.
  std::size_t featureCount(std::size_t i) const { return places_.feature_counts[i]; }

  // What training image `i` looked like, for as long as the map and the pointer live. Read from the map's file when it
  // is not in memory: what cannot be read there, or does not agree with its checksum, counts as without features.
  std::shared_ptr<const SiftFeatures> sift(std::size_t i) const { return store_->sift(i); }
  std::shared_ptr<const GlobalFeatures> global(std::size_t i) const { return store_->global(i); }
  std::vector<std::uint8_t> preview(std::size_t i) const { return store_->preview(i); }
  /// How many images' global features can be in memory at a time; see FeatureStore.
  std::size_t globalsKept() const { return store_->globalsKept(); }
  /// Everything about it, copied.
  TrainingImage image(std::size_t i) const;

  /// i_M(x) of Kronfeld et al. (journal), Eq. 3: the training image nearest to `position_m`, the first of equals.
  /// Throws std::invalid_argument when `position_m` is not finite.
  Neighbour nearest(const Eigen::Vector2d& position_m) const;
  /// The `count` nearest, closest first; fewer when the map has fewer.
  std::vector<Neighbour> nearest(const Eigen::Vector2d& position_m, std::size_t count) const;
  /// The same into memory that is there already.
  void nearest(const Eigen::Vector2d& position_m, std::size_t count, std::vector<Neighbour>& found) const;

 private:
  MapHeader header_;
  LocalFrame frame_;
  TrainingPlaces places_;
  std::unique_ptr<const FeatureStore> store_;
  Area area_;
  PositionIndex index_;
};

}  // namespace visual_localization

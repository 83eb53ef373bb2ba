#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "visual_localization/features/sift_extractor.h"
#include "visual_localization/geo/local_frame.h"
#include "visual_localization/map/position_index.h"
#include "visual_localization/map/training_image.h"

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

/// The map in memory: training images with a spatial index over their positions. Immutable, so that it can be
/// shared between threads.
class TrainingMap {
 public:
  /// Throws std::invalid_argument, in one line, when there is no image, the image size is not positive, a
  /// position or heading is not finite or a session index is out of range.
  TrainingMap(MapHeader header, std::vector<TrainingImage> images);
  TrainingMap(const TrainingMap&) = delete;
  TrainingMap& operator=(const TrainingMap&) = delete;

  const MapHeader& header() const { return header_; }
  const LocalFrame& frame() const { return frame_; }
  std::size_t size() const { return images_.size(); }
  const TrainingImage& image(std::size_t i) const { return images_[i]; }
  const std::vector<TrainingImage>& images() const { return images_; }
  /// Bounding box of the training positions.
  const Area& area() const { return area_; }

  /// i_M(x) of Kronfeld et al. (journal), Eq. 3: the training image nearest to `position_m`, the first of equals.
  /// Throws std::invalid_argument when `position_m` is not finite.
  Neighbour nearest(const Eigen::Vector2d& position_m) const;
  /// The `count` nearest, closest first; fewer when the map has fewer.
  std::vector<Neighbour> nearest(const Eigen::Vector2d& position_m, std::size_t count) const;

 private:
  MapHeader header_;
  LocalFrame frame_;
  std::vector<TrainingImage> images_;
  Area area_;
  PositionIndex index_;
};

}  // namespace visual_localization

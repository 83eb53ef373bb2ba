#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <ostream>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/map/training_map.h"

/// A map in the text format of COLMAP (colmap.github.io/format.html).
namespace visual_localization::apps {

/// What a COLMAP model holds.
struct ColmapSummary {
  std::size_t cameras = 0;
  std::size_t images = 0;
  std::size_t points = 0;
  std::size_t observations = 0;
  double error_px = 0.0;  ///< mean over the points of the mean distance of features and projections; -1: unknown
};

/// The three texts of a COLMAP model: cameras(), then image() of each image, then points(), which the images gather.
class ColmapModel {
 public:
  explicit ColmapModel(const TrainingMap& map);

  std::string cameras();
  /// Its two lines; none for an image without geometry. Throws std::runtime_error when its features cannot be read.
  std::string image(std::size_t i);
  std::string points();
  ColmapSummary summary() const { return summary_; }

 private:
  /// A landmark and what the images that show it say.
  struct Point {
    Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
    std::vector<double> errors_px;  ///< of the sightings that the lens model can project
    std::string track;              ///< for each sighting the image and its feature
  };

  void addFeatures(std::size_t i, const SiftFeatures& sift, const ImageGeometry& geometry, std::ostream& out);
  void addSighting(std::size_t i, const SiftKeypoint& at, const CameraPose& pose, const SeenLandmark& landmark);

  const TrainingMap& map_;
  std::vector<std::string> folders_;
  std::map<std::uint32_t, Point> points_;
  ColmapSummary summary_;
};

}  // namespace visual_localization::apps

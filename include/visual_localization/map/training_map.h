#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "visual_localization/camera/camera_model.h"
#include "visual_localization/camera/mask.h"
#include "visual_localization/features/global_features.h"
#include "visual_localization/features/local_feature_kind.h"
#include "visual_localization/features/local_features.h"
#include "visual_localization/features/sift.h"
#include "visual_localization/features/vlad.h"
#include "visual_localization/geo/trajectory.h"
#include "visual_localization/geometry/camera_pose.h"
#include "visual_localization/geometry/fix_budget.h"
#include "visual_localization/geometry/image_geometry.h"

namespace visual_localization {

class FeatureStore;
class PositionIndex;

/// Where and when an image of the map was taken.
struct TrainingPose {
  std::int64_t stamp_ns = 0;
  int session = 0;                                       ///< which of MapHeader::sessions it came from
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< of the robot: east, north in the map frame
  /// Of the robot where the image has geometry; otherwise the direction of travel. 0 = east, counter-clockwise.
  double yaw_rad = 0.0;
};

/// One image of the map: where it was taken and what it looked like.
struct TrainingImage : TrainingPose {
  LocalFeatures local;                         ///< after pruning
  GlobalFeatures global;                       ///< of the whole image
  std::vector<std::uint8_t> preview_jpeg;      ///< small grey JPEG for people; may be empty
  std::optional<ImageGeometry> geometry = {};  ///< none: the camera is not calibrated, or the adjustment left it out
  VladDescriptor vlad = {};                    ///< by the map's vocabulary; empty without one
};

/// Where the images of a map were taken, image by image: 40 bytes each, all that is always in memory of a large map.
struct TrainingPoses {
  std::vector<Eigen::Vector2d> positions_m;  ///< east, north in the map frame
  std::vector<double> yaws_rad;              ///< see TrainingPose
  std::vector<std::int64_t> stamps_ns;
  std::vector<std::int32_t> sessions;         ///< which of MapHeader::sessions
  std::vector<std::uint32_t> feature_counts;  ///< local features after pruning

  std::size_t size() const { return stamps_ns.size(); }
  void reserve(std::size_t count);
  void add(const TrainingPose& pose, std::size_t feature_count);
};

/// The poses of these images, in their order.
TrainingPoses posesOf(const std::vector<TrainingImage>& images);

/// A recording in a map, and the camera that made it.
struct Session {
  std::string name;
  std::optional<CameraModel> camera = {};  ///< of images of the map's size; none: not calibrated
  Mask mask = {};                          ///< of the map's size; features under it were not used
  std::optional<SensorMount> mount = {};   ///< of the robot that recorded it; none: nobody said
  /// The calibration that `camera` was adjusted from, for the same images; none: it is as it was published.
  std::optional<CameraModel> published = {};
  /// How far off its positions may be by its fixes; none: not known.
  std::optional<FixBudget> fixes = {};
  /// Where its recording contradicts itself, in order of time; none in maps of older versions.
  std::vector<DoubtfulStretch> doubtful = {};
};

/// What holds for all images of a map.
struct MapHeader {
  GeodeticPoint datum;                                                      ///< origin of the map frame
  cv::Size image_size;                                                      ///< pixels; live images are resized to it
  std::shared_ptr<const LocalFeatureKind> kind = std::make_shared<Sift>();  ///< of the local features
  std::vector<Session> sessions;                                            ///< its recordings
  std::vector<std::string> history = {};  ///< what became of it after it was built: a line for each edit, oldest first
  /// By which its images are described for proposals; null: a map of an older version, or too small to learn one.
  std::shared_ptr<const VladVocabulary> vocabulary = {};
  std::string preset = {};  ///< of the parameters that it was built with; empty: none
};

/// Axis-aligned rectangle in the map frame, metres. A range may be zero (a single straight street).
struct Area {
  Eigen::Vector2d min_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d max_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d range() const { return max_m - min_m; }
};

/// A training image and how far it is from the position asked about.
struct Neighbour {
  std::size_t image = 0;
  double distance_m = 0.0;
};

/// The map: poses of the training images in memory with a spatial index over them, and what the images looked like
/// wherever the store has it. Immutable, so that it can be shared between threads.
class TrainingMap {
 public:
  /// A map that is all in memory. Throws std::invalid_argument, in one line, when there is no image, the image size is
  /// not positive, a position or heading is not finite, a stamp is farther than 2^32 s from zero, a session index is
  /// out of range, a camera or mask is not for images of the map's size, or a geometry cannot be: numbers that are not
  /// finite, a rotation that is not of unit length, a covariance that is not symmetric and positive semi-definite, a
  /// landmark more than 100 km away, features that the image does not have or that are not in order; or when its VLAD
  /// is not of the vocabulary.
  TrainingMap(MapHeader header, std::vector<TrainingImage> images);
  /// A map whose images' looks are in `store`, which answers for their geometry. Throws like the other one.
  TrainingMap(MapHeader header, TrainingPoses poses, std::unique_ptr<const FeatureStore> store);
  ~TrainingMap();
  TrainingMap(const TrainingMap&) = delete;
  TrainingMap& operator=(const TrainingMap&) = delete;

  const MapHeader& header() const { return header_; }
  const LocalFrame& frame() const { return frame_; }
  std::size_t size() const { return poses_.size(); }
  /// Bounding box of the training positions.
  const Area& area() const { return area_; }

  // Of training image `i`, which is below size().
  const Eigen::Vector2d& position_m(std::size_t i) const { return poses_.positions_m[i]; }
  double yaw_rad(std::size_t i) const { return poses_.yaws_rad[i]; }
  TrainingPose pose(std::size_t i) const;
  /// Number of local features, without reading them.
  std::size_t featureCount(std::size_t i) const { return poses_.feature_counts[i]; }

  // What training image `i` looked like, for as long as the map and the pointer live. Read from the map's file when it
  // is not in memory: what cannot be read there, or does not agree with its checksum, counts as without features.
  std::shared_ptr<const LocalFeatures> local(std::size_t i) const;
  std::shared_ptr<const GlobalFeatures> global(std::size_t i) const;
  /// Empty in a map without a vocabulary.
  std::shared_ptr<const VladDescriptor> vlad(std::size_t i) const;
  std::vector<std::uint8_t> preview(std::size_t i) const;
  /// Its camera's pose and landmarks; null when it has none. The features of the landmarks are below featureCount(i);
  /// compare with the size of sift(i), which has none when its own row is damaged.
  std::shared_ptr<const ImageGeometry> geometry(std::size_t i) const;
  /// How many images have a geometry, and whether any has; known without reading it.
  std::size_t geometryCount() const;
  bool hasGeometry() const { return geometryCount() > 0; }
  /// How many images' global features can be in memory at a time; more than any map has when all of them are.
  std::size_t globalsKept() const;
  /// Everything about it, copied; without geometry when its features cannot be read.
  TrainingImage image(std::size_t i) const;

  /// i_M(x) of Kronfeld et al. (journal), Eq. 3: the training image nearest to `position_m`, the first of equals.
  /// Throws std::invalid_argument when `position_m` is not finite.
  Neighbour nearest(const Eigen::Vector2d& position_m) const;
  /// The `count` nearest, closest first; fewer when the map has fewer.
  std::vector<Neighbour> nearest(const Eigen::Vector2d& position_m, std::size_t count) const;
  /// The same into memory that is there already.
  void nearest(const Eigen::Vector2d& position_m, std::size_t count, std::vector<Neighbour>& found) const;
  /// Into `found`: all within `radius_m` of a position, in order; of one that is not finite none.
  void within(const Eigen::Vector2d& position_m, double radius_m, std::vector<std::uint32_t>& found) const;
  /// Into `found`: of the `count` training images nearest to image `i`, itself included, the others that are within
  /// `radius_m` and face alike, so that they can show the same; closest first. Where none does four times as many are
  /// looked at, and so on up to 1024.
  void nearestFacing(std::size_t i, std::size_t count, double radius_m, std::vector<Neighbour>& found) const;

 private:
  MapHeader header_;
  LocalFrame frame_;
  TrainingPoses poses_;
  std::unique_ptr<const FeatureStore> store_;
  Area area_;
  std::unique_ptr<const PositionIndex> index_;
};

/// Direction of travel of the training images around a position.
struct Heading {
  double yaw_rad = 0.0;
  double variance_rad2 = 0.0;  ///< how much they differ from it
};

/// That of the training image nearest to `position_m`. Where the route was driven both ways that may face the other
/// way; so if `recognised` names a training image close by that matches well, images that face away from it are left
/// out. `neighbours` is memory to work in.
Heading headingAt(const TrainingMap& map, const Eigen::Vector2d& position_m, std::optional<std::size_t> recognised,
                  std::vector<Neighbour>& neighbours);

}  // namespace visual_localization

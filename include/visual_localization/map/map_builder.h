#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "visual_localization/base/progress.h"
#include "visual_localization/features/feature_matcher.h"
#include "visual_localization/features/local_feature_kind.h"
#include "visual_localization/geo/trajectory_cleaner.h"
#include "visual_localization/geometry/fix_budget.h"
#include "visual_localization/geometry/image_geometry.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

class ExtractionPool;
class ImageSpool;
class MapWriter;
class PartialFile;
class PruningNeighbours;
struct MapFix;
struct RawImage;

/// How a recording becomes training images.
struct MapBuilderConfig {
  std::string preset;
  double min_spacing_m = 0.0;
  double spacing_m = 0.0;
  double max_megapixels = 1.0;
  bool prune = false;
  std::string model;
  std::string base_frame = "base_link";
  std::string camera_mount;
  std::string antenna_mount;
  std::string fix_frame;
  LocalFeatureConfig local;
  MatchConfig match;
  TrajectoryCleanerConfig trajectory;
  GeometryConfig geometry;

  void declare(ParameterVisitor& visitor);
};

/// The parameters that `given` names, completed by the preset among them, if there is one. `defaults`: values that give
/// way to it (see withPreset).
ParameterValues mapBuilderValues(const ParameterValues& given, const ParameterValues& defaults = {});

/// The camera of a session, for images as they are recorded.
struct SessionCamera {
  std::optional<CameraModel> model = {};  ///< none: not calibrated
  Mask mask = {};                         ///< features under it are not used; empty: all are
  std::optional<SensorMount> mount = {};  ///< none: camera and antenna are where the robot is
  cv::Size image_size = {};               ///< of most of its images, pixels; empty: that of its first image
  double clock_sigma_s = 0.1;             ///< how well the stamps of images and fixes are known to agree
};

/// What one session brought.
struct SessionImages {
  std::string name;
  std::size_t kept = 0;
  cv::Size recorded;  ///< SessionCamera::image_size, or the size of its first image
  SessionCamera camera;
  bool calibrated_by_images = false;  ///< nobody gave `camera` a model: its images did
  SessionLandmarks geometry = {};     ///< complete when the map is built
  FixBudget fixes = {};               ///< the same
  /// How many images had another size than `recorded`, by width and height in pixels.
  std::map<std::pair<int, int>, std::size_t> other_sizes = {};
};

/// A map is flat: farther from its datum north and lengths are wrong by more than a degree and a part in 8000.
constexpr double kFarthestSession_m = 1e5;
/// A session spans at least this: a receiver that always reports the same point is stuck.
constexpr double kSmallestSession_m = 0.1;
/// A robot that in kStandingTime_s comes neither as far as this nor half as far as its session usually does stands.
constexpr double kStandingReach_m = 0.5;
constexpr double kStandingTime_s = 10.0;

/// What was kept and why the rest was dropped.
struct MapBuildReport {
  cv::Size image_size;  ///< of the map's images, pixels; empty until the first one
  std::size_t images_kept = 0;
  std::size_t images_without_position = 0;  ///< before the first or after the last believable fix
  std::size_t images_too_close = 0;         ///< nearer than min_spacing_m
  std::size_t images_standing = 0;          ///< of a robot that stands: see MapBuilder::wants
  std::size_t images_of_other_shape = 0;    ///< neither SessionCamera::image_size nor of that aspect ratio
  std::size_t images_thinned = 0;           ///< after the adjustment: nearer than spacing_m
  std::size_t images_disordered = 0;        ///< stamp not after the one before
  std::size_t images_unusable = 0;          ///< could not be decoded, or too small
  std::size_t features_extracted = 0;
  std::size_t features_kept = 0;              ///< after pruning
  std::vector<CleanedTrajectory> sessions;    ///< one per session
  std::vector<SessionImages> session_images;  ///< the same
};

/// What a builder may use.
struct MapBuilderResources {
  std::size_t threads = 1;  ///< for extraction; the map does not depend on it
  /// Images wait in a temporary file beside this one until all are known; empty: in memory.
  std::string spool_beside;
};

/// What new sessions take over from a map that they will be added to.
struct MapBase {
  GeodeticPoint datum;
  cv::Size image_size;
};

/// Collects sessions and makes the map: first all fixes of a session, then its images in order of time.
class MapBuilder {
 public:
  /// Without a `base` the first session decides about datum and image size.
  explicit MapBuilder(const MapBuilderConfig& config, const MapBuilderResources& resources = {},
                      const std::optional<MapBase>& base = {});
  ~MapBuilder();

  /// Starts a session: cleans its fixes. The first believable fix ever given becomes the datum, at the middle of the
  /// altitudes. Throws std::runtime_error naming the session when the fixes are not enough for a path, when the path
  /// spans less than kSmallestSession_m, or when it lies farther than kFarthestSession_m from the datum; the builder is
  /// as before.
  void beginSession(const std::string& name, const std::vector<Fix>& fixes, const SessionCamera& camera = {});
  /// True when the image at `stamp_ns` has a position, is far enough from the last one, and does not come from a robot
  /// that has stood there (see kStandingReach_m) for longer than kStandingTime_s: only then is it worth decoding and
  /// giving to addImage. `recorded`: its size in pixels, if that is known; addImage would leave out an image of another
  /// shape. Counts the reasons otherwise.
  bool wants(std::int64_t stamp_ns, cv::Size recorded = {});
  /// `grey`: 8-bit, one channel; an empty one counts as unusable. The map's images have the size of the first
  /// session's, halved until they have no more than max_megapixels: its SessionCamera::image_size, without which its
  /// first image decides. Others are resized to it, and counted where their session has another size. Where
  /// SessionCamera::image_size is given, images of another aspect ratio are left out: no calibration holds for them.
  /// Throws CameraError when the session's camera or mask is for images of another shape, and std::runtime_error when
  /// the map's images would be too large.
  void addImage(std::int64_t stamp_ns, const cv::Mat& grey);
  /// Adjusts, prunes and indexes. Ends the builder, as save() does. Throws std::runtime_error when no image was kept.
  std::shared_ptr<const TrainingMap> build(const Progress& progress = {});
  /// The same map as a file, written image by image: what is in memory does not grow with the map, but for the poses.
  /// Throws MapStoreError besides.
  void save(const std::string& path, const Progress& progress = {});
  /// The same into a file that stays the caller's: nothing is put in place.
  void save(const PartialFile& file, const Progress& progress = {});

  /// Its features are complete when the map is built.
  const MapBuildReport& report() const { return report_; }
  /// The frame of the map; a session must have begun.
  const LocalFrame& frame() const { return frame_.value(); }

 private:
  using Sink = std::function<void(const TrainingImage& image)>;
  bool stands(const TrajectoryPoint& at);
  bool fits(cv::Size recorded);
  void fitCamera();
  void extractWaiting();
  void calibrate(const TrainingMap& unpruned);
  void finish(const Sink& sink, const Progress& progress);
  void write(MapWriter& writer, const Progress& progress);
  void learnVocabulary(const TrainingMap& unpruned, const PruningNeighbours& neighbours);
  void prune(std::size_t i, const TrainingMap& unpruned, const PruningNeighbours& neighbours_of,
             TrainingImage& image) const;
  bool hasCalibratedSession() const;
  bool adjusts() const;

  MapBuilderConfig config_;
  MapBuilderResources resources_;
  MapBuildReport report_;
  std::optional<LocalFrame> frame_;
  MapHeader header_;
  std::unique_ptr<ExtractionPool> extraction_;
  std::vector<RawImage> waiting_;  ///< for extraction
  std::size_t most_waiting_;
  std::unique_ptr<ImageSpool> spool_;       ///< not pruned yet
  std::vector<std::vector<MapFix>> fixes_;  ///< of each session
  std::optional<std::int64_t> last_stamp_ns_;
  std::optional<Eigen::Vector2d> last_kept_m_;
  std::optional<TrajectoryPoint> came_to_;  ///< where the robot is, and since when
};

}  // namespace visual_localization

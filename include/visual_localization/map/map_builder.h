#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "visual_localization/features/global_extractor.h"
#include "visual_localization/features/sift_extractor.h"
#include "visual_localization/features/sift_matcher.h"
#include "visual_localization/geo/trajectory_cleaner.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// How a recorded round becomes training images.
struct MapBuilderConfig {
  double min_spacing_m = 0.0;  ///< skip an image closer than this to the last kept one of its session
  bool prune = true;           ///< keep only features seen again in a neighbouring training image
  int preview_width_px = 80;   ///< width of the stored preview; 0 = none
  SiftConfig sift;
  MatchConfig match;
  TrajectoryCleanerConfig trajectory;

  void declare(ParameterVisitor& visitor);
  std::vector<std::string> violations() const;
};

/// What was kept and why the rest was dropped.
struct MapBuildReport {
  std::size_t images_kept = 0;
  std::size_t images_without_position = 0;  ///< before the first or after the last believable fix
  std::size_t images_too_close = 0;         ///< nearer than min_spacing_m
  std::size_t images_disordered = 0;        ///< stamp not after the one before
  std::size_t images_unusable = 0;          ///< could not be decoded, or too small
  std::size_t features_extracted = 0;
  std::size_t features_kept = 0;            ///< after pruning
  std::vector<CleanedTrajectory> sessions;  ///< one per recorded round
};

/// Called while a map is made: so many of so many images are done.
using BuildProgress = std::function<void(std::size_t done, std::size_t total)>;

/// Collects rounds and makes the map: first all fixes of a session, then its images in order of time.
class MapBuilder {
 public:
  explicit MapBuilder(const MapBuilderConfig& config);
  ~MapBuilder();

  /// Starts a round: cleans its fixes. The first believable fix ever given becomes the datum. Throws
  /// std::runtime_error naming the session when the fixes are not enough for a path.
  void beginSession(const std::string& name, const std::vector<Fix>& fixes);
  /// True when the image at `stamp_ns` has a position and is far enough from the last one: only then is it
  /// worth decoding and giving to addImage. Counts the reasons otherwise.
  bool wants(std::int64_t stamp_ns);
  /// `grey`: 8-bit, one channel; resized to the size of the first image. An empty one counts as unusable.
  void addImage(std::int64_t stamp_ns, const cv::Mat& grey);
  /// Prunes and indexes; the builder can go on afterwards. Throws std::runtime_error when no image was kept.
  std::shared_ptr<const TrainingMap> build(const BuildProgress& progress = {});

  const MapBuildReport& report() const { return report_; }

 private:
  MapBuilderConfig config_;
  MapBuildReport report_;
  std::optional<LocalFrame> frame_;
  MapHeader header_;
  std::vector<TrainingImage> images_;  ///< not pruned yet
  std::unique_ptr<SiftExtractor> sift_extractor_;
  GlobalExtractor global_extractor_;
  std::optional<std::int64_t> last_stamp_ns_;
  std::optional<Eigen::Vector2d> last_kept_m_;
};

}  // namespace visual_localization

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "visual_localization/camera/camera_model.h"
#include "visual_localization/features/global_features.h"
#include "visual_localization/features/local_features.h"
#include "visual_localization/geo/trajectory.h"
#include "visual_localization/localization/query_image.h"
#include "visual_localization/localization/similarity.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// Where a camera truly was.
struct TruePose {
  GeodeticPoint position;
  std::optional<double> yaw_rad = {};  ///< of the viewing direction, 0 = east, counter-clockwise; none: not known
};

/// CSV with the columns stamp_ns, east_m, north_m (metres from any origin) and yaw_rad. Throws FileError that names the
/// line.
Trajectory readPoses(const std::string& path);

/// Moved by the median difference on either axis. Throws std::runtime_error when the two have no time in common.
Trajectory movedOnto(const Trajectory& positions, const Trajectory& poses);

/// One image of a drive, as the front end of the localizer sees it.
struct DriveImage {
  std::int64_t stamp_ns = 0;
  std::optional<TruePose> truth;  ///< absent when it has no true position
  LocalFeatures local;            ///< pruned as its round says
  GlobalFeatures global;
  std::optional<LocalFeatures> unpruned;  ///< all its SIFT features; only kept for methods that solve poses
};

/// A recorded round as images to localise.
struct Drive {
  std::vector<DriveImage> images;
  cv::Size image_size;
  std::optional<CameraModel> camera;  ///< for images of this size; none: not calibrated, or not asked for
  double sift_ms = 0.0;               ///< mean time to extract and prune the SIFT features of an image
  double global_ms = 0.0;             ///< mean time to extract its global features
};

/// Drops what neither the image before nor the one after shows: Kronfeld et al. (conference), section VI, and
/// (journal), section 6. Every image must have its `unpruned` features. An image farther away than `max_gap_s`, or with
/// fewer than two features, is no neighbour; without any neighbour all features stay.
void pruneByBothNeighbours(std::vector<DriveImage>& images, double max_angle_ratio, double max_gap_s);

/// A recorded round in the roles it plays in an experiment; a role it does not play is empty.
struct RecordedRound {
  std::shared_ptr<const TrainingMap> map;
  std::vector<std::optional<TruePose>> map_truth;  ///< of the images of the map; empty when nothing is known
  std::shared_ptr<const Drive> drive;
};

/// All similarities between a drive and a map, computed once and shared by all runs of an experiment.
class ScoreTable {
 public:
  struct Entry {
    double sift = 0.0;  ///< similarity by SIFT
    double global = 0.0;
    std::uint32_t matches = 0;
    float scale = 1.0F;  ///< of these matches
    float vlad = 0.0F;   ///< similarity by VLAD; 0 without a vocabulary
  };

  ScoreTable(const Drive& drive, const TrainingMap& map, const MatchConfig& match, std::size_t threads);

  std::size_t trainingImages() const { return training_images_; }
  const Entry& at(std::size_t drive_image, std::size_t training_image) const {
    return entries_[drive_image * training_images_ + training_image];
  }
  /// Number of SIFT features of an image of the drive.
  std::size_t siftFeatures(std::size_t drive_image) const { return local_features_[drive_image]; }
  /// Mean processor time of one comparison.
  double siftCompare_ms() const { return sift_compare_ms_; }
  double globalCompare_ms() const { return global_compare_ms_; }

 private:
  std::size_t training_images_;
  std::vector<Entry> entries_;
  std::vector<std::size_t> local_features_;
  double sift_compare_ms_ = 0.0;
  double global_compare_ms_ = 0.0;
};

/// Recorded images whose scores are looked up instead of computed. Counts what live images would have cost.
class RecordedImage final : public QueryImage {
 public:
  /// Only `training_images` are in the map, and counted by their index in this list; all when it is empty. Both must
  /// outlive it.
  RecordedImage(const ScoreTable& table, const std::vector<std::size_t>& training_images, const MatchConfig& match,
                const SimilarityConfig& similarity);

  /// The next image. `covered`: nothing can be seen in it. `unpruned`: all its SIFT features, which must outlive it;
  /// null when they were not kept.
  void show(std::size_t drive_image, bool covered, const LocalFeatures* unpruned = nullptr);
  /// Similarities to all training images.
  void row(FeatureKind kind, std::vector<double>& similarities);
  std::size_t siftComparisons() const { return sift_comparisons_; }
  std::size_t globalComparisons() const { return global_comparisons_; }
  /// A live image would have extracted SIFT features for its pose.
  bool poseWasAsked() const { return pose_was_asked_; }

  /// There are no pixels: show() says what comes.
  void set(std::int64_t, const cv::Mat&) override {}
  /// An image that a slow drive shows again counts as another one.
  bool isRepeated() const override { return false; }
  Score compare(FeatureKind kind, std::size_t training_image) override;
  std::size_t localFeatures() override { return covered_ ? 0 : table_.siftFeatures(drive_image_); }
  ImageReport report() const override { return {}; }
  const LocalFeatures* local() const override { return nullptr; }
  const LocalFeatures* unprunedLocal() override;
  void configure(const FrontEndConfig& front_end, const SimilarityConfig& similarity) override;

 private:
  std::size_t trainingImages() const;
  const ScoreTable::Entry& entry(std::size_t training_image) const;

  const ScoreTable& table_;
  const std::vector<std::size_t>& training_images_;
  LocalSimilarity sift_;
  GlobalSimilarity global_;
  std::size_t drive_image_ = 0;
  bool covered_ = false;
  const LocalFeatures* unpruned_ = nullptr;
  bool pose_was_asked_ = false;
  std::size_t sift_comparisons_ = 0;
  std::size_t global_comparisons_ = 0;
};

}  // namespace visual_localization

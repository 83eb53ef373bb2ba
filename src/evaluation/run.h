#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "evaluation/experiment.h"
#include "evaluation/score_table.h"
#include "visual_localization/localization/estimate.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// A jump of the robot that nobody tells it about.
struct Kidnapping {
  std::size_t at = 0;  ///< number of images before it
  std::size_t to = 0;  ///< index of the first image after it
};

/// Image indices of a closed drive from `start` on, wrapping, with an optional jump (Kronfeld et al. (journal), section
/// 6). Throws std::invalid_argument for an index beyond the drive.
std::vector<std::size_t> imageOrder(std::size_t images, std::size_t start, const std::optional<Kidnapping>& kidnapping);

/// How the runs of an experiment go through a drive.
struct RunShape {
  bool closed = true;       ///< indices wrap; an open drive is followed to its end
  double speed = 1.0;       ///< images of the drive per step: at 2 every other one, at 1/2 each one twice
  bool kidnapped = false;   ///< after half of the run carried by half of the drive; an open one back
  std::size_t longest = 0;  ///< images of the drive that a run covers at most; 0: all
};

/// Once around a closed drive, to the end of an open one.
std::vector<std::size_t> imageOrder(std::size_t images, std::size_t start, const RunShape& shape);

/// Every image of a closed drive, or of the first half of an open one; `count` of them, evenly spread, unless that is 0
/// or too many.
std::vector<std::size_t> startImages(std::size_t images, bool closed, std::size_t count);
/// The same, `every` so many images. Runs of `longest` images (0: any length) may also begin that far before the end of
/// an open drive.
std::vector<std::size_t> startImagesEvery(std::size_t images, bool closed, std::size_t every, std::size_t longest);

/// A map with some of its images left out, as when the robot leaves the recorded way.
struct PartialMap {
  std::shared_ptr<const TrainingMap> map;
  std::vector<std::size_t> images;  ///< index in the whole map of each image that is left; empty when all are
};

/// Leaves out the share `gap`, beginning with image 0.35 * size, then images nearer than `spacing_m` to the last kept
/// one of their session. At least one stays.
PartialMap partOf(std::shared_ptr<const TrainingMap> map, double gap, double spacing_m = 0.0);

/// What a map has wrong at one of its training images: its pose there minus the true one.
struct MapError {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  std::optional<double> yaw_rad = {};  ///< none: the true heading is not known
};

/// For each image of `drive`, at the nearest training image that faces alike, in a map with landmarks one that has
/// some. `truth`: of the images of the whole map; nothing where not known.
std::vector<std::optional<MapError>> mapErrors(const PartialMap& part,
                                               const std::vector<std::optional<TruePose>>& truth, const Drive& drive);

/// Estimates nearer to the truth than this are right.
constexpr double kRight_m = 5.0;
/// A robot farther than this from all training images is off the map.
constexpr double kOffMap_m = 10.0;

/// How far an estimate is from a truth; NaN: not known.
struct StepErrors {
  float position_m = std::numeric_limits<float>::quiet_NaN();
  float heading_deg = std::numeric_limits<float>::quiet_NaN();
  /// Squared error of the position in units of its covariance.
  float nees = std::numeric_limits<float>::quiet_NaN();
};

/// What happened at one step of a run.
struct StepRecord {
  float error_m = std::numeric_limits<float>::quiet_NaN();  ///< NaN when the image has no true position
  float confidence = 0.0F;
  std::uint32_t comparisons = 0;
  bool sift = false;                                    ///< compared by SIFT features
  LocalizationState state = LocalizationState::kNoMap;  ///< what a tracker's localizer says; others say nothing
  bool off_map = false;                                 ///< the true position is farther than kOffMap_m from the map
  PoseSource source = PoseSource::kNone;                ///< what a tracker's pose rests on
  float heading_err_deg = std::numeric_limits<float>::quiet_NaN();  ///< NaN without a true heading or an estimate of it
  float nees = std::numeric_limits<float>::quiet_NaN();  ///< by the published covariance; METRIC or TRACKING only
  StepErrors relative = {};  ///< to the map, NEES by the covariance of METRIC poses in relation to it
  /// The same two behind a filter that fuses TRACKING METRIC poses by their covariance in relation to the map: against
  /// the truth with that of the map added.
  StepErrors filtered = {};
  StepErrors relative_filtered = {};
  bool right = false;  ///< by the accuracy of the round's true positions, as is the next
  bool wrong = false;
  float probability = std::numeric_limits<float>::quiet_NaN();  ///< of being around the estimate; NaN: not known
};

/// A closer look at one step, for the track of a single run.
struct TraceRecord {
  std::size_t image = 0;
  double diversity_m = 0.0;
  Estimate estimate;
  std::optional<Eigen::Vector2d> truth_m = {};  ///< map frame
  std::optional<double> true_yaw_rad = {};
};

/// One run of one method over one drive.
struct RunRecord {
  std::size_t start = 0;
  std::vector<StepRecord> steps;
  std::vector<TraceRecord> trace;       ///< of every step of a tracker, when asked for
  std::size_t steps_to_localise = 0;    ///< images until the first of three right estimates in a row; all when never
  std::size_t steps_to_relocalise = 0;  ///< the same after the kidnapping
  std::size_t sift_extractions = 0;     ///< SIFT extractions that a live image would have needed
  std::size_t global_extractions = 0;
  std::size_t sift_comparisons = 0;
  std::size_t global_comparisons = 0;  ///< those of guided recovery included
  double method_ms = 0.0;              ///< time of the method itself, without extraction and comparisons
};

/// Everything that the runs of one pair of rounds share.
struct RunContext {
  const PartialMap& map;
  const Drive& drive;
  const ScoreTable& table;  ///< of the whole map
  bool closed = true;
  double found_within_m = kRight_m;                      ///< of three estimates in a row: then the robot is localised
  std::vector<std::optional<MapError>> map_errors = {};  ///< of each image of the drive; empty when nothing is known
  Accuracy accuracy = {};                                ///< of the drive's true positions
  std::size_t longest = 0;                               ///< see RunShape
  std::size_t judge_from = 0;                            ///< estimates before are not judged, but count as found
};

/// From image `start` on (Kronfeld et al. (journal), section 6). `repetition`: each has another seed.
RunRecord run(const RunContext& context, const MethodSpec& method, std::size_t start, bool trace,
              std::size_t repetition = 0);

}  // namespace visual_localization

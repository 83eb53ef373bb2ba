#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include <Eigen/Core>

#include "visual_localization/features/front_end.h"
#include "visual_localization/geo/geodetic_point.h"
#include "visual_localization/localization/score.h"
#include "visual_localization/localization/tracker.h"

namespace visual_localization {

/// How far an estimate may be trusted.
enum class LocalizationState : std::uint8_t {
  kNoMap = 0,
  kInitializing = 1,  ///< the position was unknown and has not been confirmed yet
  kTracking = 2,      ///< recognised images confirm the position
  kUncertain = 3,     ///< the last images do not confirm it
  kRecovering = 4,    ///< taken to be lost; the tracker searches
  kOffMap = 5,        ///< nothing in the map has been recognised for long: probably far from all of it
};

/// "NO_MAP", "INITIALIZING", ...
std::string toString(LocalizationState state);

/// Position and heading in the map frame.
struct PoseEstimate {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();         ///< east, north
  double yaw_rad = 0.0;                                         ///< of the training image, 0 = east, ccw
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Identity();  ///< of the position
  double yaw_variance_rad2 = 0.0;
  GeodeticPoint geodetic;  ///< the same position by the map's datum
};

/// Wall-clock milliseconds of each stage of one image.
struct StageTimes {
  double extract_ms = 0.0;  ///< feature extraction and pruning
  double match_ms = 0.0;    ///< comparisons with training images
  double update_ms = 0.0;   ///< the tracker without the comparisons
};

/// Everything that is known after one image.
struct Estimate {
  std::int64_t stamp_ns = 0;  ///< of the image
  LocalizationState state = LocalizationState::kInitializing;
  PoseEstimate pose;
  Score best;                                 ///< best match among the training images compared
  std::size_t best_image = 0;                 ///< that training image
  double best_distance_m = 0.0;               ///< from the estimated position to it
  FeatureKind features = FeatureKind::kSift;  ///< by which the training images were compared
  std::size_t comparisons = 0;                ///< distinct training images compared
  std::size_t features_extracted = 0;         ///< SIFT features of the image before pruning; 0 when there was no need
  std::size_t features_kept = 0;              ///< after pruning
  double place_ratio = 1.0;                   ///< see PlaceCheck; 1 when there was no need to ask
  double course_residual_m = 0.0;             ///< see Course; of the last estimates
  ImageLook look;                             ///< of the image
  bool blind = false;                         ///< there was hardly anything to see in the image
  std::size_t repeats = 0;                    ///< images in a row, this one included, that repeated the one before
  bool frozen = false;                        ///< so many of them that the camera must be broken
  TrackerTuning tuning;
  Eigen::Vector2d spread_m = Eigen::Vector2d::Zero();  ///< sigma x, y of the cloud
  StageTimes times;
};

}  // namespace visual_localization

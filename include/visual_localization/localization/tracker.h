#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/localization/particles.h"
#include "visual_localization/localization/scores.h"
#include "visual_localization/localization/tracker_config.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// How the tracker is tuned at the moment, for people to see.
struct TrackerTuning {
  double v0 = 0.0;             ///< speed limit, share of the area's range per image
  double speed_ema = 0.0;      ///< smoothed speed of the swarm, same unit
  double quantum_share = 0.0;  ///< share of quantum particles
  double phi2 = 0.0;           ///< attraction of the best particle
  double phi0 = 0.0;           ///< random perturbation
  bool recovering = false;     ///< the position is taken to be lost
  double speed_mps = 0.0;      ///< smoothed speed of the swarm (v_sw), metres per second; 0: not known yet
};

/// What a tracker believes after an image.
struct TrackerEstimate {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();           ///< east, north in the map frame
  Eigen::Matrix2d mode_covariance_m2 = Eigen::Matrix2d::Zero();   ///< of the mode of the cloud around `position_m`
  Eigen::Matrix2d cloud_covariance_m2 = Eigen::Matrix2d::Zero();  ///< of the whole cloud, unweighted, about it
  Eigen::Vector2d spread_m = Eigen::Vector2d::Zero();             ///< sigma_x, sigma_y (Weiss et al., Eq. 2)
  std::size_t training_image = 0;                                 ///< nearest to `position_m`
  Score best;                                                     ///< best score among the training images compared
  std::size_t best_image = 0;                                     ///< the training image of `best`
  double best_distance_m = 0.0;                                   ///< from `position_m` to `best_image`
  TrackerTuning tuning;                                           ///< for the next image
  /// Of several swarms: how well the best rival matches, share of all that they match. Above a half another place fits
  /// better than `position_m`, but not for long enough yet.
  double rival_weight = 0.0;
};

class PlaceFilter;
class SessionChoice;

/// What one image brings to a tracker.
struct TrackerInput {
  Scores& scores;                 ///< of the image, by the features chosen for it
  MapSweep& sweep;                ///< where it may have been taken, should the position be lost
  const SessionChoice& sessions;  ///< which training image stands for a position
  Travel travel = {};             ///< since the last image
  /// Where landmarks verify that the image was taken: particles are weighed by their distance from there, and no
  /// training image is compared.
  std::optional<Eigen::Vector2d> verified_m = {};
};

/// Follows the position from image to image.
class Tracker {
 public:
  virtual ~Tracker() = default;
  /// Forgets the past: the robot may be anywhere in the map's area.
  virtual void reset() = 0;
  /// Forgets the past; the particles of the next image are drawn from `prior`.
  virtual void reset(const Prior& prior) = 0;
  /// Goes on with other parameters; the particles stay. Tracker and number of particles must be the ones it has.
  virtual void configure(const TrackerConfig& config) = 0;
  /// One image: moves the particles, scores them, estimates.
  virtual TrackerEstimate update(const TrackerInput& input) = 0;
  /// A verified position of the last image: the next one is searched around it.
  virtual void attract(const Eigen::Vector2d& position_m) = 0;
  virtual const std::vector<Particle>& particles() const = 0;
  virtual TrackerTuning tuning() const = 0;
  /// How likely each training image is, where it keeps a posterior over them; null otherwise.
  virtual const PlaceFilter* belief() const { return nullptr; }
};

/// The chosen tracker, with its particles anywhere in the map. `map` must outlive it.
std::unique_ptr<Tracker> makeTracker(const TrainingMap& map, const TrackerConfig& config, std::uint32_t seed);

}  // namespace visual_localization

#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/localization/motion_model.h"
#include "visual_localization/localization/particles.h"
#include "visual_localization/localization/place_proposal.h"
#include "visual_localization/localization/scores.h"
#include "visual_localization/map/training_map.h"
#include "visual_localization/parameters/parameter_visitor.h"

namespace visual_localization {

/// How fitness falls off beside the recorded path.
struct FitnessConfig {
  double distance_sigma_m = 10.0;  ///< std of zeta in Kronfeld et al. (journal), Eq. 3

  void declare(ParameterVisitor& visitor);
  std::vector<std::string> violations() const { return {}; }
};

/// f(x, t) and the training image it rests on.
struct Fitness {
  double value = 0.0;
  std::size_t training_image = 0;
  Score score;
};

/// f(x, t) = m(i_M(x), s(t)) * zeta(distance to i_M(x)), Kronfeld et al. (journal), Eq. 3, zeta a Gaussian of
/// height one; m as the weight that its similarity gives it.
Fitness evaluateFitness(const Eigen::Vector2d& position_m, const TrainingMap& map, ScoreCache& scores,
                        const FitnessConfig& config);

/// What a tracker believes after an image.
struct TrackerEstimate {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();          ///< east, north in the map frame
  Eigen::Matrix2d mode_covariance_m2 = Eigen::Matrix2d::Zero();  ///< of the mode of the cloud around `position_m`
  Eigen::Matrix2d cloud_covariance_m2 =
      Eigen::Matrix2d::Zero();                         ///< of the whole cloud, unweighted, about `position_m`
  Eigen::Vector2d spread_m = Eigen::Vector2d::Zero();  ///< sigma_x, sigma_y of the cloud (Weiss et al., Eq. 2)
  std::size_t training_image = 0;                      ///< nearest to `position_m`
  Score best;                                          ///< best score among the training images compared
  std::size_t best_image = 0;                          ///< the training image of `best`
  double best_distance_m = 0.0;                        ///< from `position_m` to `best_image`
};

/// How the tracker is tuned at the moment, for people to see.
struct TrackerTuning {
  double v0 = 0.0;             ///< speed limit, share of the area's range per image
  double speed_ema = 0.0;      ///< smoothed speed of the swarm, same unit
  double quantum_share = 0.0;  ///< share of quantum particles
  double phi2 = 0.0;           ///< attraction of the best particle
  bool recovering = false;     ///< the position is taken to be lost
};

/// What one image brings to a tracker.
struct TrackerInput {
  ScoreCache& scores;     ///< of the image by the features chosen for it
  PlaceProposal& places;  ///< where it may have been taken, should the position be lost
  Travel travel = {};     ///< since the last image
};

struct TrackerConfig;

/// Follows the position from image to image, with or without odometry.
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
  virtual const std::vector<Particle>& particles() const = 0;
  virtual TrackerTuning tuning() const = 0;
};

}  // namespace visual_localization

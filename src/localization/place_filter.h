#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "localization/off_map.h"
#include "localization/place_probabilities.h"
#include "localization/places.h"
#include "visual_localization/localization/likelihood.h"
#include "visual_localization/localization/motion.h"
#include "visual_localization/localization/particles.h"
#include "visual_localization/localization/reason.h"
#include "visual_localization/localization/scores.h"
#include "visual_localization/localization/tracker_config.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// What an image says of the training images: of those it was compared with, how likely it is there, not normalised.
struct PlaceLikelihood {
  struct Compared {
    std::size_t training_image = 0;
    double likelihood = 0.0;
    std::optional<double> log_matches = {};  ///< see OffMapBelief; nothing of other features, or of a pose
  };
  std::vector<Compared> compared;
  std::size_t asked_in_turn = 0;  ///< of `compared`, from this one on chosen whatever the image shows
  double elsewhere = 1.0;         ///< of each training image that it was not compared with
  bool is_verified = false;       ///< landmarks say where the robot is
  bool is_aside = false;          ///< and that is far from all places
};

/// Discrete Bayes filter over the training images and places beyond the ends of their path: how likely the robot is at
/// each. Beyond an end it sees the image at the end as well as there, or less well; so the motion tells the difference,
/// and how well the right image matched before. It moves along the direction that
/// they look, as fast as the session did there times a factor of which a distribution is kept (0: it stands), or as
/// odometry says, and to any of them with a small probability: it may have been carried away, or lost. Between sessions
/// it moves as within one.
class PlaceFilter {
 public:
  /// `map` must outlive the filter. Anywhere.
  PlaceFilter(const TrainingMap& map, const BayesConfig& config);

  void configure(const BayesConfig& config) { config_ = config; }
  /// Anywhere again.
  void reset();
  /// At the training images nearest to these positions, each counted the same; there must be one.
  void reset(const std::vector<Eigen::Vector2d>& positions_m);
  /// The motion since the last image.
  void predict(const Motion& motion);
  /// How likely an image with this score was taken at the training image: a power of the matches and one, or what the
  /// score counts for a particle where there are none. Images that follow each other more closely than the training
  /// images do are not independent: the nearer they are the less each says.
  double likelihoodOf(const Score& score) const;
  PlaceLikelihood::Compared comparedWith(std::size_t training_image, const Score& score) const;
  /// What the comparisons that another tracker chose say. It may not have looked at the right place: elsewhere is half
  /// way, on a logarithmic scale, between chance and what matched best lately.
  PlaceLikelihood likelihoodBeside(const std::vector<Scores::Compared>& compared);
  /// What the image says.
  void update(const PlaceLikelihood& likelihood);

  /// Of each place; they sum to one.
  const PlaceProbabilities& probabilities() const { return places_; }
  const Places& places() const { return where_; }
  /// Of being within `radius_m` of a position, given that the robot is at one of the places.
  double within(const Eigen::Vector2d& position_m, double radius_m) const;
  /// The same, without that.
  double probabilityWithin(const Eigen::Vector2d& position_m, double radius_m) const {
    return (1.0 - off_map_.probability()) * within(position_m, radius_m);
  }
  /// Of being where the map has no image: beyond an end of its path or elsewhere.
  double offMap() const;
  /// What it says when the robot is taken to be within `radius_m` of a position.
  PlaceBelief beliefAround(const Eigen::Vector2d& position_m, double radius_m) const;
  /// How likely an image is taken at each place by its distance from a position. `seen`: what it is like there.
  PlaceLikelihood around(const Eigen::Vector2d& position_m, const std::optional<Fitness>& seen = {}) const;

  /// The training images that the most probable places show, at most `count` distinct ones.
  std::vector<std::size_t> mostProbableImages(std::size_t count) const;
  /// The position with most probability around, and its covariance there.
  CloudMoments mode() const;
  /// Of everything that is possible, about `centre_m`.
  Eigen::Matrix2d covarianceAbout(const Eigen::Vector2d& centre_m) const;
  /// Expected speed at a training image, metres per second.
  double speed_mps(std::size_t training_image) const;
  /// Usual distance of successive training images.
  double spacing_m() const { return spacing_m_; }
  /// Training images this near may look alike: some metres, where the map is not smaller than that.
  double around_m() const { return std::max(3.0 * spacing_m_, std::min(5.0, 8.0 * spacing_m_)); }

  /// Speeds as shares of the session's.
  static constexpr std::array<double, 11> kSpeeds{-1.0, 0.0, 0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0};
  using PerSpeed = std::array<double, kSpeeds.size()>;

 private:
  /// Where the robot comes to, by each speed; added up as each training image becomes a place it may come to.
  struct Arrival {
    std::uint32_t training_image = 0;
    PerSpeed by_speed{};
    double by_odometry = 0.0;
  };

  /// How far along the direction that a training image looks, backwards negative.
  struct Way {
    double distance_m = 0.0;
    double sigma_m = 0.0;
  };

  double learnPace();
  void learnMoments();
  void forgetMotion();
  double secondsOf(const Motion& motion) const;
  /// From a training image, at a share of the session's speed; and by odometry.
  Way wayAt(double speed, std::size_t image, const Motion& motion) const;
  Way wayBy(const Motion& motion) const;
  void moveFrom(std::size_t image, const Motion& motion);
  Arrival& arrivalAt(std::size_t image);
  double expectedSpeed() const;
  double followedShare() const;
  void learnSpeed(double elsewhere);
  double leavingFrom(std::size_t image, const Motion& motion) const;
  void updateOffMap(const PlaceLikelihood& likelihood);
  double beyond(std::size_t training_image) const;
  double beyond() const;
  std::optional<PlaceBelief::Place> likelyEnd() const;
  std::optional<PlaceBelief::Place> rivalOf(const Eigen::Vector2d& position_m, double radius_m) const;
  void setLikelihoodBeyond(const PlaceLikelihood::Compared& compared);
  void learnMatches(const PlaceLikelihood& likelihood);

  const TrainingMap& map_;
  BayesConfig config_;
  double spacing_m_ = 1.0;
  double interval_s_ = 1.0;      ///< usual time between successive training images
  std::vector<float> pace_mps_;  ///< of the session at each training image
  Places where_;
  Eigen::Vector2d centroid_m_ = Eigen::Vector2d::Zero();  ///< of the places
  Eigen::Matrix2d scatter_m2_ = Eigen::Matrix2d::Zero();  ///< about it, not divided by their number
  PlaceProbabilities places_;
  PerSpeed speeds_{};               ///< how likely each of kSpeeds is
  std::optional<double> odometry_;  ///< how likely it tells the way; wherever the robot is, so that no reset changes it
  std::vector<Arrival> arrivals_;
  std::optional<double> log_best_;  ///< of the likelihoods of late, smoothed
  double independence_ = 1.0;       ///< of the image from the one before, (0, 1]
  OffMapBelief off_map_;
  double leaving_ = 0.0;  ///< how likely the motion leads beyond the training images
  std::vector<OffMapBelief::Compared> asked_;
  std::vector<Neighbour> neighbours_;
  mutable std::vector<std::uint32_t> around_;
  std::vector<double> ahead_m_;
  std::vector<double> kernel_;
};

}  // namespace visual_localization

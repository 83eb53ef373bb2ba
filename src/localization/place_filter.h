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
#include "visual_localization/localization/motion.h"
#include "visual_localization/localization/particles.h"
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
  bool is_verified = false;       ///< landmarks say that the robot is in the map
};

/// Discrete Bayes filter over the training images: how likely the robot is at each. It moves along the direction that
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

  /// Of each training image; they sum to one.
  const PlaceProbabilities& probabilities() const { return places_; }
  /// Of being within `radius_m` of a position.
  double within(const Eigen::Vector2d& position_m, double radius_m) const;
  /// Of being where the map has no image. The other probabilities are given that it is not.
  double offMap() const { return off_map_.probability(); }
  /// How likely an image is taken at each training image by its distance from a position.
  PlaceLikelihood around(const Eigen::Vector2d& position_m) const;

  /// The position with most probability around, and its covariance there.
  CloudMoments mode() const;
  /// Of everything that is possible, about `centre_m`.
  Eigen::Matrix2d covarianceAbout(const Eigen::Vector2d& centre_m) const;
  /// Expected speed at a training image, metres per second.
  double speed_mps(std::size_t training_image) const;
  /// Usual distance of successive training images.
  double spacing_m() const { return spacing_m_; }
  /// Training images this near are one place: `least_m`, or three of them where they are farther apart.
  double around_m(double least_m = 5.0) const { return std::max(least_m, 3.0 * spacing_m_); }

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

  void learnPace();
  void learnMoments();
  void forgetMotion();
  double secondsOf(const Motion& motion) const;
  /// From a training image, at a share of the session's speed; and by odometry.
  Way wayAt(double speed, std::size_t image, const Motion& motion) const;
  Way wayBy(const Motion& motion) const;
  void moveFrom(std::size_t image, const Motion& motion);
  Arrival& arrivalAt(std::size_t image);
  double expectedSpeed() const;
  void learnSpeed(double elsewhere);
  double leavingFrom(std::size_t image, const Motion& motion) const;
  void updateOffMap(const PlaceLikelihood& likelihood);
  void learnMatches(const PlaceLikelihood& likelihood);

  const TrainingMap& map_;
  BayesConfig config_;
  double spacing_m_ = 1.0;
  double interval_s_ = 1.0;                               ///< usual time between successive training images
  std::vector<float> pace_mps_;                           ///< of the session at each training image
  Eigen::Vector2d centroid_m_ = Eigen::Vector2d::Zero();  ///< of the training images
  Eigen::Matrix2d scatter_m2_ = Eigen::Matrix2d::Zero();  ///< about it, not divided by their number
  PlaceProbabilities places_;
  PerSpeed speeds_{};  ///< how likely each of kSpeeds is
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

#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "localization/place_filter.h"
#include "visual_localization/localization/particles.h"
#include "visual_localization/localization/tracker.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// Follows the position by a discrete Bayes filter over the training images. Compares an image with the most probable
/// ones, with such as look alike as a whole where the map has more than that, and with a few others in turn, which tell
/// what a similarity to a wrong place is like.
class BayesTracker final : public Tracker {
 public:
  /// `map` must outlive the tracker. Starts anywhere in the map.
  BayesTracker(const TrainingMap& map, const TrackerConfig& config, std::uint32_t seed);

  void reset(const Prior& prior) override;
  bool configure(const TrackerConfig& config) override;
  void predict(const Motion& motion) override;
  void update(Likelihood& likelihood) override;
  const TrackerEstimate& belief() const override { return belief_; }
  /// Drawn from the posterior.
  const std::vector<Particle>& particles() const override { return particles_; }
  const PlaceFilter* posterior() const override { return &filter_; }

 private:
  void choose(Likelihood& likelihood);
  PlaceLikelihood compare(Likelihood& image);
  TrackerEstimate estimate(Likelihood& likelihood);
  void drawParticles();

  const TrainingMap& map_;
  BayesConfig config_;
  Random random_;
  PlaceFilter filter_;
  std::vector<Particle> particles_;
  TrackerEstimate belief_;
  bool seen_an_image_ = false;
  bool is_known_ = false;
  bool is_sure_ = false;             ///< most of the probability is around the last estimate
  std::size_t images_ = 0;           ///< since the start
  std::vector<std::size_t> chosen_;  ///< training images to be compared; the last kOthers of them in turn
  std::size_t others_ = 0;
};

}  // namespace visual_localization

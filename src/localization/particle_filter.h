#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "localization/motion_model.h"
#include "visual_localization/localization/particles.h"
#include "visual_localization/localization/tracker.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// The motion of the tracker called `tracker`, "pf_gaussian" or "pf_linear", with the pull towards the training images.
/// `map` must outlive it.
std::unique_ptr<MotionModel> makeMotionModel(const std::string& tracker, const ParticleFilterConfig& config,
                                             const TrainingMap& map, const OdometryConfig& odometry = {});

/// Particle filter without odometry (Weiss et al., section IV.A): resample, move, weigh, estimate the weighted
/// mean, replace the worst by random particles.
class ParticleFilter final : public Tracker {
 public:
  /// `map` must outlive the filter. Starts anywhere in the map's area.
  ParticleFilter(const TrainingMap& map, std::unique_ptr<MotionModel> motion, const ParticleFilterConfig& config,
                 const FitnessConfig& fitness, std::uint32_t seed);

  void reset() override { reset(anywhere_); }
  void reset(const Prior& prior) override;
  void configure(const TrackerConfig& config) override;
  TrackerEstimate update(const TrackerInput& input) override;
  void attract(const Eigen::Vector2d& position_m) override;
  const std::vector<Particle>& particles() const override { return particles_; }
  TrackerTuning tuning() const override { return {}; }

 private:
  void resample();
  void weigh(const TrackerInput& input);
  TrackerEstimate estimate() const;
  void injectRandomParticles();

  const TrainingMap& map_;
  std::unique_ptr<MotionModel> motion_;
  ParticleFilterConfig config_;
  FitnessConfig fitness_config_;
  Random random_;
  Prior anywhere_;
  std::vector<Particle> particles_;
  std::vector<Particle> drawn_;     ///< of the last resampling; kept to save the allocation
  std::vector<std::size_t> order_;  ///< of the particles by weight
  Fitness best_;                    ///< of the last image
  bool seen_an_image_ = false;
};

}  // namespace visual_localization

#include "localization/particle_filter.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <Eigen/Geometry>

#include "base/numbers.h"
#include "localization/session_choice.h"
#include "visual_localization/localization/particles.h"

namespace visual_localization {

void GaussianMotion::move(Particle& particle, const Travel&, Random& random) const {
  particle.position_m += random.normal(Eigen::Vector2d(std_m_, std_m_));
}

void LinearMotion::start(Particle& particle, Random& random) const {
  const double direction_rad = random.uniform(-kPi, kPi);
  particle.velocity_m = initial_speed_m_ * Eigen::Vector2d(std::cos(direction_rad), std::sin(direction_rad));
}

/// Kronfeld et al. (journal), Eq. 7 and 8: the velocity is rotated, then scaled.
void LinearMotion::move(Particle& particle, const Travel&, Random& random) const {
  const Eigen::Rotation2Dd rotation(random.normal(rotation_std_rad_));
  particle.velocity_m = std::exp(random.normal(acceleration_std_)) * (rotation * particle.velocity_m);
  particle.position_m += particle.velocity_m;
}

void OdometryMotion::move(Particle& particle, const Travel& travel, Random& random) const {
  if (!travel.odometry || random.uniform(0.0, 1.0) >= config_.share) {
    return otherwise_->move(particle, travel, random);
  }
  constexpr double kLeast_m = 0.2;  // particles are as far apart as the training images allow
  const double sigma_m = kLeast_m + config_.distance_sigma * travel.odometry->distance_m;
  particle.position_m +=
      wayInMap(map_, particle.position_m, *travel.odometry) + random.normal(Eigen::Vector2d(sigma_m, sigma_m));
}

void PullToMap::move(Particle& particle, const Travel&, Random&) const {
  const Eigen::Vector2d target_m = map_.position_m(map_.nearest(particle.position_m).image);
  particle.position_m += share_ * (target_m - particle.position_m);
}

CombinedMotion::CombinedMotion(std::vector<std::unique_ptr<MotionModel>> parts) : parts_(std::move(parts)) {}

void CombinedMotion::start(Particle& particle, Random& random) const {
  for (const auto& part : parts_) part->start(particle, random);
}

void CombinedMotion::move(Particle& particle, const Travel& travel, Random& random) const {
  for (const auto& part : parts_) part->move(particle, travel, random);
}

std::unique_ptr<MotionModel> makeMotionModel(const std::string& tracker, const ParticleFilterConfig& config,
                                             const TrainingMap& map, const OdometryConfig& odometry) {
  std::unique_ptr<MotionModel> of_papers;
  if (tracker == "pf_gaussian") {
    of_papers = std::make_unique<GaussianMotion>(config.gaussian_std_m);
  } else {
    of_papers = std::make_unique<LinearMotion>(toRadians(config.rotation_std_deg), config.acceleration_std,
                                               config.initial_speed_m);
  }
  std::vector<std::unique_ptr<MotionModel>> parts;
  parts.push_back(std::make_unique<OdometryMotion>(map, odometry, std::move(of_papers)));
  if (config.pull > 0.0) parts.push_back(std::make_unique<PullToMap>(map, config.pull));
  return std::make_unique<CombinedMotion>(std::move(parts));
}

ParticleFilter::ParticleFilter(const TrainingMap& map, std::unique_ptr<MotionModel> motion,
                               const ParticleFilterConfig& config, const FitnessConfig& fitness, std::uint32_t seed)
    : map_(map),
      motion_(std::move(motion)),
      config_(config),
      fitness_config_(fitness),
      random_(seed),
      anywhere_(anywhere(map.area())),
      particles_(static_cast<std::size_t>(config.particles)),
      order_(particles_.size()) {
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  reset();
}

void ParticleFilter::reset(const Prior& prior) {
  for (Particle& particle : particles_) {
    particle = Particle();
    particle.position_m = prior(random_);
    particle.weight = 1.0 / static_cast<double>(particles_.size());
    motion_->start(particle, random_);
  }
  seen_an_image_ = false;
}

void ParticleFilter::configure(const TrackerConfig& config) {
  config_ = config.pf;
  fitness_config_ = config.fitness;
  motion_ = makeMotionModel(config.tracker, config.pf, map_, config.odometry);
}

TrackerEstimate ParticleFilter::update(const TrackerInput& input) {
  if (seen_an_image_) {
    resample();
    for (Particle& particle : particles_) motion_->move(particle, input.travel, random_);
  }
  seen_an_image_ = true;
  weigh(input);
  TrackerEstimate result = estimate();
  injectRandomParticles();
  return result;
}

/// As one more likelihood.
void ParticleFilter::attract(const Eigen::Vector2d& position_m) {
  for (Particle& particle : particles_) particle.weight *= fitnessAbout(position_m, particle.position_m);
  normaliseWeights(particles_);
}

/// Low-variance resampling: one random offset, then equal steps through the cumulated weights.
void ParticleFilter::resample() {
  const double step = 1.0 / static_cast<double>(particles_.size());
  const double offset = random_.uniform(0.0, step);
  drawn_.clear();
  std::size_t source = 0;
  double cumulated = particles_[0].weight;
  for (std::size_t i = 0; i < particles_.size(); ++i) {
    const double target = offset + static_cast<double>(i) * step;
    while (target > cumulated && source + 1 < particles_.size()) cumulated += particles_[++source].weight;
    drawn_.push_back(particles_[source]);
  }
  particles_.swap(drawn_);
}

void ParticleFilter::weigh(const TrackerInput& input) {
  best_ = Fitness();
  for (Particle& particle : particles_) {
    const Fitness fitness =
        input.verified_m ? Fitness{fitnessAbout(*input.verified_m, particle.position_m), 0, {}}
                         : evaluateFitness(input.sessions.nearest(particle.position_m), input.scores, fitness_config_);
    particle.weight = fitness.value;
    if (fitness.score.similarity > best_.score.similarity) best_ = fitness;
  }
  normaliseWeights(particles_);
}

TrackerEstimate ParticleFilter::estimate() const {
  const CloudMoments cloud = momentsOf(particles_);
  TrackerEstimate result;
  result.position_m = cloud.mean_m;
  result.mode_covariance_m2 = cloud.covariance_m2;
  result.cloud_covariance_m2 = scatterAbout(cloud.mean_m, particles_);
  result.spread_m = cloud.spread();
  result.training_image = map_.nearest(result.position_m).image;
  result.best = best_.score;
  result.best_image = best_.score.similarity > 0.0 ? best_.training_image : result.training_image;
  result.best_distance_m = (map_.position_m(result.best_image) - result.position_m).norm();
  return result;
}

/// So that a lost or kidnapped robot is found again (Weiss et al., section IV.A, last step).
void ParticleFilter::injectRandomParticles() {
  const auto count =
      static_cast<std::size_t>(std::lround(config_.random_share * static_cast<double>(particles_.size())));
  if (count == 0) return;
  std::partial_sort(order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(count), order_.end(),
                    [this](std::size_t a, std::size_t b) {
                      return std::make_pair(particles_[a].weight, a) < std::make_pair(particles_[b].weight, b);
                    });
  for (std::size_t i = 0; i < count; ++i) {
    Particle& particle = particles_[order_[i]];
    particle.position_m = anywhere_(random_);
    particle.weight = 1.0 / static_cast<double>(particles_.size());
    motion_->start(particle, random_);
  }
  normaliseWeights(particles_);
}

}  // namespace visual_localization

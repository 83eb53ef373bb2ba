#include "localization/particle_filter.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <Eigen/Geometry>

#include "base/numbers.h"
#include "visual_localization/localization/particles.h"
#include "visual_localization/localization/tracker_config.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

void ParticleFilterConfig::declare(ParameterVisitor& visitor) {
  visitor.integer({"pf/particles", "1", "number of particles (m)"}, particles, 2, 100000);
  visitor.real({"pf/pull", "1", "share of the way to its nearest training image that a particle is moved"}, pull, 0.0,
               1.0);
  visitor.real({"pf/random_share", "1", "worst particles that are replaced by random ones after each image"},
               random_share, 0.0, 1.0);
  visitor.real({"pf/gaussian_std", "m", "step of pf_gaussian per image and axis"}, gaussian_std_m, 0.0, 1000.0);
  visitor.real({"pf/rotation_std", "deg", "how much pf_linear turns per image (sigma_rot)"}, rotation_std_deg, 0.0,
               180.0);
  visitor.real(
      {"pf/acceleration_std", "1", "how much the logarithm of pf_linear's speed changes per image (sigma_acc)"},
      acceleration_std, 0.0, 1.0);
  visitor.real({"pf/initial_speed", "m", "first speed of pf_linear's particles per image (v_init)"}, initial_speed_m,
               0.0, 1000.0);
}

void GaussianMotion::move(Particle& particle, const Motion&, Random& random) const {
  particle.position_m += random.normal(Eigen::Vector2d(std_m_, std_m_));
}

void LinearMotion::start(Particle& particle, Random& random) const {
  const double direction_rad = random.uniform(-kPi, kPi);
  particle.velocity_m = initial_speed_m_ * Eigen::Vector2d(std::cos(direction_rad), std::sin(direction_rad));
}

/// Kronfeld et al. (journal), Eq. 7 and 8: the velocity is rotated, then scaled.
void LinearMotion::move(Particle& particle, const Motion&, Random& random) const {
  const Eigen::Rotation2Dd rotation(random.normal(rotation_std_rad_));
  particle.velocity_m = std::exp(random.normal(acceleration_std_)) * (rotation * particle.velocity_m);
  particle.position_m += particle.velocity_m;
}

void OdometryMotion::move(Particle& particle, const Motion& motion, Random& random) const {
  if (!motion.carries(random)) return otherwise_->move(particle, motion, random);
  constexpr double kLeast_m = 0.2;  // particles are as far apart as the training images allow
  const double sigma_m = kLeast_m + motion.sigma_m();
  particle.position_m +=
      motion.displacementAt(map_, particle.position_m) + random.normal(Eigen::Vector2d(sigma_m, sigma_m));
}

void PullToMap::move(Particle& particle, const Motion&, Random&) const {
  const Eigen::Vector2d target_m = map_.position_m(map_.nearest(particle.position_m).image);
  particle.position_m += share_ * (target_m - particle.position_m);
}

CombinedMotion::CombinedMotion(std::vector<std::unique_ptr<MotionModel>> parts) : parts_(std::move(parts)) {}

void CombinedMotion::start(Particle& particle, Random& random) const {
  for (const auto& part : parts_) part->start(particle, random);
}

void CombinedMotion::move(Particle& particle, const Motion& motion, Random& random) const {
  for (const auto& part : parts_) part->move(particle, motion, random);
}

std::unique_ptr<MotionModel> makeMotionModel(const std::string& tracker, const ParticleFilterConfig& config,
                                             const TrainingMap& map) {
  std::unique_ptr<MotionModel> of_papers;
  if (tracker == "pf_gaussian") {
    of_papers = std::make_unique<GaussianMotion>(config.gaussian_std_m);
  } else {
    of_papers = std::make_unique<LinearMotion>(toRadians(config.rotation_std_deg), config.acceleration_std,
                                               config.initial_speed_m);
  }
  std::vector<std::unique_ptr<MotionModel>> parts;
  parts.push_back(std::make_unique<OdometryMotion>(map, std::move(of_papers)));
  if (config.pull > 0.0) parts.push_back(std::make_unique<PullToMap>(map, config.pull));
  return std::make_unique<CombinedMotion>(std::move(parts));
}

ParticleFilter::ParticleFilter(const TrainingMap& map, const TrackerConfig& config, std::uint32_t seed)
    : ParticleFilter(map, makeMotionModel(config.tracker, config.pf, map), config.pf, seed) {}

ParticleFilter::ParticleFilter(const TrainingMap& map, std::unique_ptr<MotionModel> motion,
                               const ParticleFilterConfig& config, std::uint32_t seed)
    : map_(map),
      motion_(std::move(motion)),
      config_(config),
      random_(seed),
      anywhere_(anywhere(map.area())),
      particles_(static_cast<std::size_t>(config.particles)),
      order_(particles_.size()) {
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  reset(anywhere_);
}

void ParticleFilter::reset(const Prior& prior) {
  for (Particle& particle : particles_) {
    particle = Particle();
    particle.position_m = prior(random_);
    particle.weight = 1.0 / static_cast<double>(particles_.size());
    motion_->start(particle, random_);
  }
  is_new_ = true;
  belief_ = {};
}

bool ParticleFilter::configure(const TrackerConfig& config) {
  if (static_cast<std::size_t>(config.pf.particles) != particles_.size()) return false;
  config_ = config.pf;
  motion_ = makeMotionModel(config.tracker, config.pf, map_);
  return true;
}

void ParticleFilter::predict(const Motion& motion) {
  if (std::exchange(is_new_, true)) return;
  resample();
  for (Particle& particle : particles_) motion_->move(particle, motion, random_);
}

void ParticleFilter::update(Likelihood& likelihood) {
  const bool first_of_image = std::exchange(is_new_, false);
  if (first_of_image) {
    for (Particle& particle : particles_) particle.weight = 1.0;  // each was drawn by its weight before
  }
  weigh(likelihood);
  belief_ = estimate();
  if (first_of_image) injectRandomParticles();
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

void ParticleFilter::weigh(Likelihood& likelihood) {
  best_ = Fitness();
  for (Particle& particle : particles_) {
    const Fitness fitness = likelihood.at(particle.position_m);
    particle.weight *= fitness.value;
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

#include "localization/papers/particle_filter.h"

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
namespace {

bool weighsLess(const Particle& a, const Particle& b) { return a.weight < b.weight; }

}  // namespace

void ParticleFilterConfig::declare(ParameterVisitor& visitor) {
  visitor.integer({"pf/particles", "1", "number of particles (m)"}, particles, 2, 100000);
  visitor.choice({"pf/selection", "",
                  "particles are drawn by their weights, or by these scaled linearly (scaled), so that the best one is "
                  "drawn (1 + pf/selection_floor) / pf/selection_floor times as often as the worst"},
                 selection, {"weights", "scaled"});
  visitor.real({"pf/selection_floor", "1", "of the scaled selection (Q)"}, selection_floor, 0.0, 100.0);
  visitor.choice({"pf/draws", "", "by one random offset and equal steps (low_variance), or each for itself"}, draws,
                 {"low_variance", "independent"});
  visitor.real({"pf/pull", "1", "share of the way to its nearest training image that a particle is moved"}, pull, 0.0,
               1.0);
  visitor.real({"pf/random_share", "1", "share of particles that are random for each image"}, random_share, 0.0, 1.0);
  visitor.choice({"pf/random_particles", "",
                  "in place of the worst after the estimate (worst), or as a part of the selection, before the motion"},
                 random_particles, {"worst", "selection"});
  visitor.choice({"pf/confine", "", "particles may be anywhere (none), or are put on the border of the area (box)"},
                 confine, {"none", "box"});
  visitor.choice({"pf/position", "", "estimate: weighted mean of the cloud, or its best particle"}, position,
                 {"mean", "best"});
  visitor.real({"pf/gaussian_std", "m", "step of pf_gaussian per image and axis"}, gaussian_std_m, 0.0, 1000.0);
  visitor.real({"pf/rotation_std", "deg", "how much pf_linear turns per image (sigma_rot)"}, rotation_std_deg, 0.0,
               180.0);
  visitor.real(
      {"pf/acceleration_std", "1", "how much the logarithm of pf_linear's speed changes per image (sigma_acc)"},
      acceleration_std, 0.0, 1.0);
  visitor.real({"pf/initial_speed", "m", "first speed of pf_linear's particles per image (v_init)"}, initial_speed_m,
               0.0, 1000.0);
  visitor.choice(
      {"pf/initial_speed_of", "", "the same along both axes (metres), or each axis in proportion to the area's range"},
      initial_speed_of, {"metres", "range"});
}

void GaussianMotion::move(Particle& particle, const Motion&, Random& random) const {
  particle.position_m += random.normal(Eigen::Vector2d(std_m_, std_m_));
}

void LinearMotion::start(Particle& particle, Random& random) const {
  const double direction_rad = random.uniform(-kPi, kPi);
  particle.velocity_m =
      initial_speed_m_.cwiseProduct(Eigen::Vector2d(std::cos(direction_rad), std::sin(direction_rad)));
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

void StayInArea::move(Particle& particle, const Motion&, Random&) const {
  particle.position_m = particle.position_m.cwiseMax(area_.min_m).cwiseMin(area_.max_m);
}

namespace {

/// v_init of each axis. By the range its root mean square over both axes is the same.
Eigen::Vector2d initialSpeed_m(const ParticleFilterConfig& config, const Area& area) {
  const Eigen::Vector2d range_m = area.range();
  const double usual_m = std::sqrt(0.5) * range_m.norm();
  if (config.initial_speed_of != "range" || usual_m <= 0.0) return Eigen::Vector2d::Constant(config.initial_speed_m);
  return config.initial_speed_m / usual_m * range_m;
}

}  // namespace

std::unique_ptr<MotionModel> makeMotionModel(const std::string& tracker, const ParticleFilterConfig& config,
                                             const TrainingMap& map) {
  std::unique_ptr<MotionModel> of_papers;
  if (tracker == "pf_gaussian") {
    of_papers = std::make_unique<GaussianMotion>(config.gaussian_std_m);
  } else {
    of_papers = std::make_unique<LinearMotion>(toRadians(config.rotation_std_deg), config.acceleration_std,
                                               initialSpeed_m(config, map.area()));
  }
  std::vector<std::unique_ptr<MotionModel>> parts;
  parts.push_back(std::make_unique<OdometryMotion>(map, std::move(of_papers)));
  if (config.pull > 0.0) parts.push_back(std::make_unique<PullToMap>(map, config.pull));
  if (config.confine == "box") parts.push_back(std::make_unique<StayInArea>(map.area()));
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
  select();
  for (Particle& particle : particles_) motion_->move(particle, motion, random_);
}

void ParticleFilter::update(Likelihood& likelihood) {
  const bool first_of_image = std::exchange(is_new_, false);
  if (first_of_image) {
    for (Particle& particle : particles_) particle.weight = 1.0;  // each was drawn by its weight before
  }
  weigh(likelihood);
  belief_ = estimate();
  if (first_of_image && config_.random_particles == "worst") replaceWorst();
}

/// The next generation, random particles included where they belong to it.
void ParticleFilter::select() {
  if (config_.selection == "scaled") scaleWeights();
  const std::size_t random = config_.random_particles == "selection" ? randomCount() : 0;
  drawn_.clear();
  const std::size_t survivors = particles_.size() - random;
  config_.draws == "independent" ? drawIndependently(survivors) : drawEvenly(survivors);
  particles_.swap(drawn_);
  particles_.resize(survivors + random);
  for (std::size_t i = survivors; i < particles_.size(); ++i) makeRandom(particles_[i]);
}

/// (f - f_min) / (f_max - f_min) + Q, as the toolkit of the authors of Kronfeld et al. selects (Eva2).
void ParticleFilter::scaleWeights() {
  const auto [least, most] = std::minmax_element(particles_.begin(), particles_.end(), weighsLess);
  const double worst = least->weight;
  const double range = most->weight - worst;
  for (Particle& particle : particles_) {
    particle.weight = (range > 0.0 ? (particle.weight - worst) / range : 0.0) + config_.selection_floor;
  }
  normaliseWeights(particles_);
}

/// Low-variance resampling: one random offset, then equal steps through the cumulated weights.
void ParticleFilter::drawEvenly(std::size_t count) {
  const double step = 1.0 / static_cast<double>(count);
  const double offset = random_.uniform(0.0, step);
  std::size_t source = 0;
  double cumulated = particles_[0].weight;
  for (std::size_t i = 0; i < count; ++i) {
    const double target = offset + static_cast<double>(i) * step;
    while (target > cumulated && source + 1 < particles_.size()) cumulated += particles_[++source].weight;
    drawn_.push_back(particles_[source]);
  }
}

/// Roulette.
void ParticleFilter::drawIndependently(std::size_t count) {
  cumulated_.clear();
  double sum = 0.0;
  for (const Particle& particle : particles_) cumulated_.push_back(sum += particle.weight);
  for (std::size_t i = 0; i < count; ++i) {
    const auto found = std::upper_bound(cumulated_.begin(), cumulated_.end(), random_.uniform(0.0, sum));
    const auto source = static_cast<std::size_t>(found - cumulated_.begin());
    drawn_.push_back(particles_[std::min(source, particles_.size() - 1)]);
  }
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
  const auto best = std::max_element(particles_.begin(), particles_.end(), weighsLess);
  TrackerEstimate result;
  result.position_m = config_.position == "best" ? best->position_m : cloud.mean_m;
  result.mode_covariance_m2 = covarianceAbout(result.position_m, particles_);
  result.cloud_covariance_m2 = scatterAbout(result.position_m, particles_);
  result.spread_m = cloud.spread();
  result.training_image = map_.nearest(result.position_m).image;
  result.best = best_.score;
  result.best_image = best_.score.similarity > 0.0 ? best_.training_image : result.training_image;
  result.best_distance_m = (map_.position_m(result.best_image) - result.position_m).norm();
  return result;
}

std::size_t ParticleFilter::randomCount() const {
  return static_cast<std::size_t>(std::lround(config_.random_share * static_cast<double>(particles_.size())));
}

void ParticleFilter::makeRandom(Particle& particle) {
  particle.weight = 1.0 / static_cast<double>(particles_.size());
  particle.position_m = anywhere_(random_);
  motion_->start(particle, random_);
}

/// So that a lost or kidnapped robot is found again (Weiss et al., section IV.A, last step).
void ParticleFilter::replaceWorst() {
  const std::size_t count = randomCount();
  if (count == 0) return;
  std::partial_sort(order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(count), order_.end(),
                    [this](std::size_t a, std::size_t b) {
                      return std::make_pair(particles_[a].weight, a) < std::make_pair(particles_[b].weight, b);
                    });
  for (std::size_t i = 0; i < count; ++i) makeRandom(particles_[order_[i]]);
  normaliseWeights(particles_);
}

}  // namespace visual_localization

#include "localization/papers/dpso.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "visual_localization/geo/trajectory.h"
#include "visual_localization/localization/particles.h"

namespace visual_localization {
namespace {

double approach(double from, double to, double start, double share) {
  const double step = std::abs(to - start) * share;
  return from < to ? std::min(to, from + step) : std::max(to, from - step);
}

}  // namespace

Dpso::Dpso(const TrainingMap& map, const DpsoConfig& config, std::uint32_t seed)
    : map_(map), config_(config), random_(seed), area_(map.area()) {
  particles_.resize(static_cast<std::size_t>(config.particles));
  fitness_.resize(particles_.size());
  reset(anywhere(area_));
}

void Dpso::reset(const Prior& prior) {
  tuning_ = {config_.v0, 0.0, config_.quantum_share, config_.phi2, config_.phi0, false};
  attractor_m_.reset();
  centre_of_mass_m_.reset();
  last_centre_m_.reset();
  speeds_known_ = 0;
  ground_speed_known_ = false;
  seen_an_image_ = false;
  position_unknown_ = prior.isUnknown();
  bad_images_ = 0;
  belief_ = {};
  for (Particle& particle : particles_) {
    particle = Particle();
    particle.position_m = prior(random_);
    for (int axis = 0; axis < 2; ++axis) {
      particle.velocity_m[axis] = random_.uniform(-1.0, 1.0) * config_.v0 * range_m()[axis];
    }
    particle.velocity_m = limited(particle.velocity_m, config_.v0);
    particle.weight = 1.0 / static_cast<double>(particles_.size());
    confine(particle);
  }
  assignKinds();
}

bool Dpso::configure(const TrackerConfig& config) {
  if (static_cast<std::size_t>(config.dpso.particles) != particles_.size()) return false;
  configure(config.dpso);
  return true;
}

void Dpso::configure(const DpsoConfig& config) {
  const DpsoConfig before = std::exchange(config_, config);
  choices_ = Choices(config_);
  if (config_.v0 != before.v0) tuning_.v0 = config_.v0;
  if (config_.quantum_share != before.quantum_share) tuning_.quantum_share = config_.quantum_share;
  if (config_.phi2 != before.phi2) tuning_.phi2 = config_.phi2;
  if (config_.phi0 != before.phi0) tuning_.phi0 = config_.phi0;
  tuning_.v0 = std::clamp(tuning_.v0, config_.v0_min, config_.v0_max);
  if (config_.recovery == "none" && tuning_.recovering) endRecovery();
  belief_.recovering = tuning_.recovering;
  assignKinds();
}

void Dpso::predict(const Motion& motion) {
  is_new_ = true;
  seconds_ = motion.seconds();
  if (!seen_an_image_) return;
  for (Particle& particle : particles_) {
    if (motion.carries(random_)) particle.position_m += motion.displacementAt(map_, particle.position_m);
  }
  if (attractor_m_) *attractor_m_ += motion.displacementAt(map_, *attractor_m_);
  if (centre_of_mass_m_) centre_of_mass_m_ = centreOfMass();
}

void Dpso::update(Likelihood& likelihood) {
  const bool first_of_image = std::exchange(is_new_, false);
  if (first_of_image) fly(likelihood);
  weigh(likelihood);
  belief_ = estimate();
  if (first_of_image) adapt();
  belief_.recovering = tuning_.recovering;
  report();
}

void Dpso::fly(Likelihood& likelihood) {
  for (Particle& particle : particles_) {
    if (particle.kind == ParticleKind::kQuantum && isGuided()) {
      particle.velocity_m.setZero();
      particle.position_m = map_.position_m(likelihood.draw(random_));
    } else if (seen_an_image_) {
      particle.kind == ParticleKind::kQuantum ? moveQuantum(particle) : move(particle);
    }
    confine(particle);
    keepOut(particle);
  }
  seen_an_image_ = true;
}

void Dpso::resize(std::size_t particles) {
  const std::size_t before = particles_.size();
  if (particles == before) return;
  particles_.resize(particles);
  for (std::size_t i = before; i < particles; ++i) particles_[i] = particles_[i % before];
  fitness_.resize(particles);
  normaliseWeights(particles_);
  assignKinds();
  if (centre_of_mass_m_) last_centre_m_ = centre_of_mass_m_ = centreOfMass();
}

void Dpso::exclude(const std::vector<Eigen::Vector2d>& places_m, double radius_m) {
  excluded_m_ = places_m;
  exclusion_radius_m_ = radius_m;
}

/// The first particles are the quantum ones, the last the high-energy ones, so that a growing quantum share
/// takes from the standard ones.
void Dpso::assignKinds() {
  const auto count = static_cast<double>(particles_.size());
  const auto quantum = static_cast<std::size_t>(std::lround(tuning_.quantum_share * count));
  const auto high_energy = static_cast<std::size_t>(std::lround(config_.high_energy_share * count));
  for (std::size_t i = 0; i < particles_.size(); ++i) {
    particles_[i].kind = i < quantum                            ? ParticleKind::kQuantum
                         : i + high_energy >= particles_.size() ? ParticleKind::kHighEnergy
                                                                : ParticleKind::kStandard;
  }
}

/// Kronfeld et al. (journal), Eq. 4 and 5, with r0 in [-1, 1] so that the swarm does not drift one way.
void Dpso::move(Particle& particle) {
  const double factor = particle.kind == ParticleKind::kHighEnergy ? config_.high_energy_factor : 1.0;
  const double boost = config_.high_energy_perturbation ? factor : 1.0;
  Eigen::Vector2d wanted_m;
  for (int axis = 0; axis < 2; ++axis) {
    const double perturbation = boost * tuning_.phi0 * random_.uniform(-1.0, 1.0) * range_m()[axis] * tuning_.v0;
    const double attraction =
        attractor_m_ ? tuning_.phi2 * random_.uniform(0.0, 1.0) * ((*attractor_m_)[axis] - particle.position_m[axis])
                     : 0.0;
    wanted_m[axis] = config_.inertia * particle.velocity_m[axis] + perturbation + attraction;
  }
  particle.velocity_m = limited(wanted_m, factor * tuning_.v0);
  particle.position_m += particle.velocity_m;
}

/// Length of a displacement in shares of the area's range, or of its diagonal; an axis without range cannot be
/// travelled.
double Dpso::relativeLength(const Eigen::Vector2d& displacement_m) const {
  const Eigen::Vector2d range = range_m();
  const Eigen::Array2d possible_m = (range.array() > 0.0).select(displacement_m.array(), 0.0);
  if (choices_.by_diagonal) return range.norm() > 0.0 ? possible_m.matrix().norm() / range.norm() : 0.0;
  return (possible_m / (range.array() > 0.0).select(range.array(), 1.0)).matrix().norm();
}

/// `limit`: share of the range. The norm of Kronfeld et al. (journal), section 3, or each axis alone.
Eigen::Vector2d Dpso::limited(const Eigen::Vector2d& velocity_m, double limit) const {
  const Eigen::Vector2d range = range_m();
  if (choices_.limit_of_axis) return velocity_m.cwiseMax(-limit * range).cwiseMin(limit * range);
  const double length = relativeLength(velocity_m);
  const Eigen::Vector2d possible_m = (range.array() > 0.0).select(velocity_m.array(), 0.0);
  return length > limit ? Eigen::Vector2d(limit / length * possible_m) : possible_m;
}

/// Kronfeld et al. (journal), Eq. 6; anywhere as long as nothing was recognised.
void Dpso::moveQuantum(Particle& particle) {
  particle.velocity_m.setZero();
  particle.position_m = attractor_m_ ? *attractor_m_ + random_.normal(Eigen::Vector2d(config_.quantum_std * range_m()))
                                     : anywhere(area_)(random_);
}

/// Whether quantum particles go where the whole image looks alike instead of around the best particle.
bool Dpso::isGuided() const {
  if (!choices_.guided) return false;
  return tuning_.recovering || (config_.guided_start && position_unknown_);
}

/// Where the likelihood knows its peak that is the best position, which no particle can match.
void Dpso::weigh(Likelihood& likelihood) {
  std::size_t best = 0;
  for (std::size_t i = 0; i < particles_.size(); ++i) {
    fitness_[i] = likelihood.at(particles_[i].position_m);
    particles_[i].weight = fitness_[i].value;
    if (fitness_[i].value > fitness_[best].value) best = i;
  }
  normaliseWeights(particles_);
  best_ = Fitness();
  for (const Fitness& fitness : fitness_) {
    if (fitness.score.similarity > best_.score.similarity) best_ = fitness;
  }
  // An image that matches nothing says nothing about where to go: the attractor stays where it was.
  if (fitness_[best].value > 0.0) attractor_m_ = particles_[best].position_m;
  const auto peak_m = likelihood.peak_m();
  if (!peak_m) return;
  best_ = likelihood.at(*peak_m);
  found(*peak_m);
}

void Dpso::found(const Eigen::Vector2d& position_m) {
  attractor_m_ = position_m;
  position_unknown_ = false;
  bad_images_ = 0;
  if (tuning_.recovering) endRecovery();
}

/// The best particle; before any image was recognised, the middle of the cloud.
TrackerEstimate Dpso::estimate() const {
  const CloudMoments cloud = momentsOf(particles_);
  TrackerEstimate result;
  result.position_m = positionOf_m(cloud);
  result.training_image = map_.nearest(result.position_m).image;
  result.mode_covariance_m2 = covarianceAbout(result.position_m, particles_, config_.mode_radius_m);
  result.cloud_covariance_m2 = scatterAbout(result.position_m, particles_);
  result.spread_m = cloud.spread();
  result.best = best_.score;
  result.best_image = best_.score.similarity > 0.0 ? best_.training_image : result.training_image;
  result.best_distance_m = (map_.position_m(result.best_image) - result.position_m).norm();
  return result;
}

/// The estimates that the conference paper names in section IV and V. Before any image was recognised they are the
/// middle of the cloud.
Eigen::Vector2d Dpso::positionOf_m(const CloudMoments& cloud) const {
  if (!attractor_m_ || config_.position == "centre") return cloud.mean_m;
  return config_.position == "best" ? *attractor_m_ : centreOfBest_m();
}

/// Of as many particles as are asked for, if so many match anything; where none does, the best one there was.
Eigen::Vector2d Dpso::centreOfBest_m() const {
  std::vector<std::size_t> order(particles_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto count = std::min(order.size(), static_cast<std::size_t>(config_.best_particles));
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end(),
                    [this](std::size_t a, std::size_t b) {
                      return std::make_pair(-fitness_[a].value, a) < std::make_pair(-fitness_[b].value, b);
                    });
  Eigen::Vector2d sum_m = Eigen::Vector2d::Zero();
  double matching = 0.0;
  for (std::size_t i = 0; i < count && fitness_[order[i]].value > 0.0; ++i) {
    sum_m += particles_[order[i]].position_m;
    matching += 1.0;
  }
  return matching > 0.0 ? Eigen::Vector2d(sum_m / matching) : *attractor_m_;
}

/// Of which v_sw is the speed.
Eigen::Vector2d Dpso::centreOfMass() const {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double count = 0.0;
  for (const Particle& particle : particles_) {
    if (particle.kind == ParticleKind::kQuantum && choices_.speed_of_moving) continue;
    sum += particle.position_m;
    count += 1.0;
  }
  return count > 0.0 ? Eigen::Vector2d(sum / count) : momentsOf(particles_).mean_m;
}

void Dpso::adapt() {
  adaptSpeed();
  adaptDiversity();
  assignKinds();
  centre_of_mass_m_ = centreOfMass();  // of the particles that count from now on
  if (!last_centre_m_ || seconds_ > 0.0) last_centre_m_ = centre_of_mass_m_;
}

Eigen::Vector2d Dpso::meanVelocity_m() const {
  Eigen::Vector2d sum_m = Eigen::Vector2d::Zero();
  double count = 0.0;
  for (const Particle& particle : particles_) {
    if (particle.kind != ParticleKind::kStandard) continue;
    sum_m += particle.velocity_m;
    count += 1.0;
  }
  return count > 0.0 ? Eigen::Vector2d(sum_m / count) : sum_m;
}

/// Of the newest speed in the average.
double Dpso::newestShare() const {
  if (speeds_known_ == 0) return 1.0;
  if (config_.ema_start == "first") return config_.ema_alpha;
  return std::max(config_.ema_alpha, 2.0 / (static_cast<double>(speeds_known_) + 2.0));
}

void Dpso::learnSpeed() {
  const Eigen::Vector2d centre = centreOfMass();
  if (!centre_of_mass_m_) return;
  const double share = newestShare();
  if (choices_.speed_of_velocity) {
    velocity_ema_m_ = (1.0 - share) * velocity_ema_m_ + share * meanVelocity_m();
    tuning_.speed_ema = relativeLength(velocity_ema_m_);
  } else {
    tuning_.speed_ema = (1.0 - share) * tuning_.speed_ema + share * relativeLength(centre - *centre_of_mass_m_);
  }
  ++speeds_known_;
  if (!(seconds_ > 0.0)) return;
  const double speed_mps = (centre - *last_centre_m_).norm() / seconds_;
  const double newest = ground_speed_known_ ? config_.ema_alpha : 1.0;
  tuning_.speed_mps = (1.0 - newest) * tuning_.speed_mps + newest * speed_mps;
  ground_speed_known_ = true;
}

/// Holds v0 at about twice the speed of the swarm (journal, section 5, "Self-adaptive parameters").
void Dpso::adaptSpeed() {
  learnSpeed();
  if (!config_.adapt_speed || tuning_.recovering || speeds_known_ == 0) return;
  const double ratio = tuning_.speed_ema / tuning_.v0;
  if (ratio > 0.6) tuning_.v0 *= 1.1;
  if (ratio < 0.4) tuning_.v0 *= config_.v0_decrease;
  tuning_.v0 = std::clamp(tuning_.v0, config_.v0_min, config_.v0_max);
}

/// Recovery phase of the same section: a best match that stays bad boosts the diversity step by step; the
/// first good one ends it.
void Dpso::adaptDiversity() {
  const bool bad = !best_.score.recognised;
  if (!bad) position_unknown_ = false;
  if (config_.recovery == "none") return;
  bad_images_ = bad ? bad_images_ + 1 : 0;
  if (!bad && tuning_.recovering) endRecovery();
  tuning_.recovering = bad_images_ >= config_.recovery_patience;
  if (!tuning_.recovering) return;
  tuning_.v0 = approach(tuning_.v0, config_.v0_max, config_.v0, config_.recovery_step);
  tuning_.quantum_share =
      approach(tuning_.quantum_share, config_.quantum_share_max, config_.quantum_share, config_.recovery_step);
  tuning_.phi2 = approach(tuning_.phi2, config_.phi2_min, config_.phi2, config_.recovery_step);
  tuning_.phi0 = approach(tuning_.phi0, std::max(config_.phi0, config_.phi0_max), config_.phi0, config_.recovery_step);
}

void Dpso::report() {
  belief_.report.set("v0", tuning_.v0);
  belief_.report.set("speed_ema", tuning_.speed_ema);
  belief_.report.set("quantum_share", tuning_.quantum_share);
  belief_.report.set("phi2", tuning_.phi2);
  belief_.report.set("phi0", tuning_.phi0);
  belief_.report.set("speed_mps", tuning_.speed_mps);
}

void Dpso::endRecovery() {
  tuning_ = {config_.v0, tuning_.speed_ema, config_.quantum_share, config_.phi2, config_.phi0,
             false,      tuning_.speed_mps};
  speeds_known_ = 0;
  ground_speed_known_ = false;
  bad_images_ = 0;
}

// Where the particles of the swarm may go.

namespace {

/// Keeps a particle inside the area; the velocity that led out of it becomes this many times what it was.
void keepInside(Particle& particle, const Area& area, double bounce = 0.0) {
  for (int axis = 0; axis < 2; ++axis) {
    const double inside = std::clamp(particle.position_m[axis], area.min_m[axis], area.max_m[axis]);
    if (inside != particle.position_m[axis]) particle.velocity_m[axis] *= bounce;
    particle.position_m[axis] = inside;
  }
}

/// Keeps a particle this close to a position and stops the velocity that led away from it.
void keepNear(Particle& particle, const Eigen::Vector2d& position_m, double farthest_m) {
  const Eigen::Vector2d offset_m = particle.position_m - position_m;
  const double distance_m = offset_m.norm();
  if (distance_m <= farthest_m) return;
  const Eigen::Vector2d away = offset_m / distance_m;
  particle.position_m = position_m + farthest_m * away;
  particle.velocity_m -= std::max(0.0, particle.velocity_m.dot(away)) * away;
}

Area wholeFrame() {
  const Eigen::Vector2d farthest_m = Eigen::Vector2d::Constant(kLargestCoordinate_m);
  return {-farthest_m, farthest_m};
}

}  // namespace

/// Back to the best particle, unless that is there as well.
void Dpso::keepOut(Particle& particle) const {
  if (!attractor_m_) return;
  for (const Eigen::Vector2d& place_m : excluded_m_) {
    const bool is_in = (particle.position_m - place_m).norm() < exclusion_radius_m_;
    if (is_in && (*attractor_m_ - place_m).norm() >= exclusion_radius_m_) particle.position_m = *attractor_m_;
  }
}

/// The papers let particles go where they will; nothing is known of positions outside of the map's frame.
void Dpso::confine(Particle& particle) const {
  if (choices_.in_box) return keepInside(particle, area_, choices_.reflects ? -1.0 : 0.0);
  keepInside(particle, wholeFrame());
  if (!choices_.in_corridor) return;
  const std::size_t nearest = map_.nearest(particle.position_m).image;
  keepNear(particle, map_.position_m(nearest), config_.corridor_m);
}

}  // namespace visual_localization

#include "localization/papers/multi_swarm.h"

#include <algorithm>
#include <utility>

namespace visual_localization {
namespace {

constexpr double kMemory = 0.8;          ///< share of a swarm's strength that an image leaves
constexpr double kStronger = 1.1;        ///< so much stronger than the leader a rival takes its place
constexpr std::size_t kRivalsShare = 7;  ///< a rival has this part of all particles
constexpr std::size_t kLeastImages = 3;  ///< before a rival may lead or is given up
constexpr double kStart_m = 2.0;         ///< spread of a rival that begins

}  // namespace

MultiSwarm::MultiSwarm(const TrainingMap& map, const TrackerConfig& config, std::uint32_t seed)
    : map_(map), config_(config.dpso), random_(seed) {
  for (int i = 0; i < DpsoConfig::kMostSwarms; ++i) {
    swarms_.push_back({std::make_unique<Dpso>(map, config.dpso, seed + static_cast<std::uint32_t>(i))});
  }
  particles_.reserve(static_cast<std::size_t>(config_.particles));
  reset(anywhere(map.area()));
}

void MultiSwarm::reset(const Prior& prior) {
  restart();
  swarms_.front().dpso->reset(prior);
  belief_ = {};
  gather();
}

bool MultiSwarm::configure(const TrackerConfig& config) {
  config_ = config.dpso;
  while (active_ > static_cast<std::size_t>(config_.swarms)) dissolve(active_ - 1);
  for (Swarm& swarm : swarms_) swarm.dpso->configure(config.dpso);
  share();
  gather();
  belief_.recovering = swarms_.front().dpso->tuning().recovering;
  return true;
}

void MultiSwarm::predict(const Motion& motion) {
  for (std::size_t i = 0; i < active_; ++i) swarms_[i].dpso->predict(motion);
}

/// Where the likelihood knows its peak there are no rivals.
void MultiSwarm::update(Likelihood& likelihood) {
  if (likelihood.peak_m()) {
    restart();
    exclude();
    swarms_.front().dpso->update(likelihood);
    swarms_.front().estimate = swarms_.front().dpso->belief();
  } else {
    exclude();
    follow(likelihood);
    chooseLeader();
    for (std::size_t i = active_; i-- > 1;) {
      if (isSuperfluous(i)) dissolve(i);
    }
    scout(likelihood);
  }
  belief_ = estimate();
}

/// The leader alone, as if it had followed no image yet: where geometry verified a pose, or after a reset, what it
/// matched before says nothing.
void MultiSwarm::restart() {
  active_ = 1;
  swarms_.front().images = 0;
  swarms_.front().unrecognised = 0;
  share();
}

/// A rival has a fixed part of the particles, the leader the rest.
void MultiSwarm::share() {
  const auto all = static_cast<std::size_t>(config_.particles);
  const std::size_t of_rival = std::max<std::size_t>(2, all / kRivalsShare);
  for (std::size_t i = 1; i < active_; ++i) swarms_[i].dpso->resize(of_rival);
  swarms_.front().dpso->resize(all - (active_ - 1) * of_rival);
}

void MultiSwarm::exclude() {
  for (std::size_t i = 0; i < active_; ++i) {
    others_m_.clear();
    for (std::size_t k = 0; k < active_; ++k) {
      if (k != i) others_m_.push_back(swarms_[k].estimate.position_m);
    }
    swarms_[i].dpso->exclude(others_m_, config_.exclusion_radius_m);
  }
}

void MultiSwarm::follow(Likelihood& likelihood) {
  for (std::size_t i = 0; i < active_; ++i) {
    Swarm& swarm = swarms_[i];
    swarm.dpso->update(likelihood);
    swarm.estimate = swarm.dpso->belief();
    const double matched = swarm.estimate.best.weight;
    swarm.strength = swarm.images == 0 ? matched : kMemory * swarm.strength + (1.0 - kMemory) * matched;
    swarm.unrecognised = swarm.estimate.best.recognised ? 0 : swarm.unrecognised + 1;
    ++swarm.images;
  }
}

void MultiSwarm::chooseLeader() {
  std::size_t strongest = 0;
  for (std::size_t i = 1; i < active_; ++i) {
    if (swarms_[i].images < kLeastImages) continue;
    const double needed = strongest == 0 ? kStronger * swarms_.front().strength : swarms_[strongest].strength;
    if (swarms_[i].strength > needed) strongest = i;
  }
  if (strongest == 0) return;
  std::swap(swarms_.front(), swarms_[strongest]);
  share();
}

/// The swarm waits; its particles are the leader's.
void MultiSwarm::dissolve(std::size_t swarm) {
  --active_;
  std::swap(swarms_[swarm], swarms_[active_]);
  share();
}

/// Lost, weak, or where a swarm before it is.
bool MultiSwarm::isSuperfluous(std::size_t swarm) const {
  const Swarm& rival = swarms_[swarm];
  for (std::size_t i = 0; i < swarm; ++i) {
    const double apart_m = (swarms_[i].estimate.position_m - rival.estimate.position_m).norm();
    if (apart_m < config_.exclusion_radius_m) return true;
  }
  if (rival.unrecognised >= static_cast<std::size_t>(config_.recovery_patience)) return true;
  return rival.images >= kLeastImages && rival.strength < config_.rival_share * swarms_.front().strength;
}

bool MultiSwarm::isTaken(const Eigen::Vector2d& position_m) const {
  return std::any_of(swarms_.begin(), swarms_.begin() + static_cast<std::ptrdiff_t>(active_), [&](const Swarm& swarm) {
    return (swarm.estimate.position_m - position_m).norm() < config_.exclusion_radius_m;
  });
}

/// A leader that is lost needs its particles to find its place again.
void MultiSwarm::scout(Likelihood& likelihood) {
  const Swarm& leader = swarms_.front();
  const bool lost = !leader.estimate.best.recognised || leader.estimate.recovering;
  if (lost || active_ == static_cast<std::size_t>(config_.swarms)) return;
  const std::size_t image = likelihood.draw(random_);
  const Eigen::Vector2d& position_m = map_.position_m(image);
  if (isTaken(position_m)) return;
  const Score found = likelihood.of(image);
  if (!found.recognised || found.weight < config_.rival_share * leader.estimate.best.weight) return;
  Swarm& rival = swarms_[active_++];
  rival.strength = found.weight;
  rival.images = 1;
  rival.unrecognised = 0;
  share();
  rival.dpso->reset(normallyDistributed(position_m, kStart_m * kStart_m * Eigen::Matrix2d::Identity()));
  rival.estimate.position_m = position_m;
}

/// The leader's, with the cloud of all.
TrackerEstimate MultiSwarm::estimate() {
  gather();
  TrackerEstimate result = swarms_.front().estimate;
  result.cloud_covariance_m2 = scatterAbout(result.position_m, particles_);
  result.spread_m = momentsOf(particles_).spread();
  double all = 0.0;
  double best_rival = 0.0;
  for (std::size_t i = 0; i < active_; ++i) all += swarms_[i].strength;
  for (std::size_t i = 1; i < active_; ++i) best_rival = std::max(best_rival, swarms_[i].strength);
  result.report.set("rival_weight", all > 0.0 ? best_rival / all : 0.0);
  return result;
}

/// Each swarm's weights sum to its share of the strength of all.
void MultiSwarm::gather() {
  particles_.clear();
  for (std::size_t i = 0; i < active_; ++i) {
    for (Particle particle : swarms_[i].dpso->particles()) {
      if (active_ > 1) particle.weight *= swarms_[i].strength;
      particles_.push_back(particle);
    }
  }
  normaliseWeights(particles_);
}

}  // namespace visual_localization

#include "localization/bayes_tracker.h"

#include <algorithm>
#include <cmath>

#include "base/numbers.h"

namespace visual_localization {
namespace {

constexpr std::size_t kOthers = 10;   ///< training images that are compared in turn
constexpr double kKnown = 0.9;        ///< probability around the estimate, from which on few are compared
constexpr double kSure = 0.97;        ///< and fewer, where that is in the map
constexpr std::size_t kProposed = 6;  ///< every so-many-th looks alike as a whole

}  // namespace

BayesTracker::BayesTracker(const TrainingMap& map, const TrackerConfig& config, std::uint32_t seed)
    : map_(map),
      config_(config.bayes),
      random_(seed),
      filter_(map, config.bayes),
      particles_(static_cast<std::size_t>(config.pf.particles)) {
  drawParticles();
}

void BayesTracker::reset(const Prior& prior) {
  constexpr std::size_t kDraws = 1000;
  if (prior.isUnknown()) {
    filter_.reset();
  } else {
    std::vector<Eigen::Vector2d> drawn_m;
    while (drawn_m.size() < kDraws) drawn_m.push_back(prior(random_));
    filter_.reset(drawn_m);
  }
  seen_an_image_ = is_known_ = is_sure_ = false;
  belief_ = {};
  drawParticles();
}

bool BayesTracker::configure(const TrackerConfig& config) {
  if (static_cast<std::size_t>(config.pf.particles) != particles_.size()) return false;
  config_ = config.bayes;
  filter_.configure(config.bayes);
  return true;
}

void BayesTracker::predict(const Motion& motion) {
  if (seen_an_image_) filter_.predict(motion);
  ++images_;
}

void BayesTracker::update(Likelihood& likelihood) {
  seen_an_image_ = true;
  chosen_.clear();
  if (const auto peak_m = likelihood.peak_m()) {
    filter_.update(filter_.around(*peak_m, likelihood.seenAtPeak()));
  } else {
    choose(likelihood);
    filter_.update(compare(likelihood));
  }
  drawParticles();
  belief_ = estimate(likelihood);
}

void BayesTracker::choose(Likelihood& likelihood) {
  const int count = is_sure_ ? config_.sure_comparisons : is_known_ ? config_.comparisons : config_.first_comparisons;
  const auto most = static_cast<std::size_t>(count);
  others_ = std::min({kOthers, most / 2, map_.size()});
  const std::size_t rest = most - others_;
  const bool sees_all = map_.size() <= static_cast<std::size_t>(config_.first_comparisons);
  std::vector<std::size_t> proposed;
  if (!sees_all) proposed = likelihood.mostSimilar(is_known_ ? rest / kProposed : rest / 2);
  chosen_ = filter_.mostProbableImages(rest - std::min(rest, proposed.size()));
  chosen_.insert(chosen_.end(), proposed.begin(), proposed.end());
  std::sort(chosen_.begin(), chosen_.end());
  chosen_.erase(std::unique(chosen_.begin(), chosen_.end()), chosen_.end());
  // Evenly over the map, so that all of it is seen after some images: a robot that was carried away is found there.
  const double stride = static_cast<double>(map_.size()) / static_cast<double>(others_);
  const double golden = std::fmod(0.618033988749895 * static_cast<double>(images_), 1.0);
  for (std::size_t i = 0; i < others_; ++i) {
    const auto image = static_cast<std::size_t>((static_cast<double>(i) + golden) * stride);
    chosen_.push_back(std::min(image, map_.size() - 1));
  }
}

/// A training image that the image was not compared with is as likely as the usual one of those that were taken in
/// turn.
PlaceLikelihood BayesTracker::compare(Likelihood& image) {
  PlaceLikelihood likelihood;
  likelihood.asked_in_turn = chosen_.size() - others_;
  std::vector<double> usual;
  for (std::size_t i = 0; i < chosen_.size(); ++i) {
    likelihood.compared.push_back(filter_.comparedWith(chosen_[i], image.of(chosen_[i])));
    if (i >= likelihood.asked_in_turn) usual.push_back(likelihood.compared.back().likelihood);
  }
  likelihood.elsewhere = median(std::move(usual));
  return likelihood;
}

TrackerEstimate BayesTracker::estimate(Likelihood& likelihood) {
  const CloudMoments mode = filter_.mode();
  const double around_m = filter_.around_m();
  is_known_ = filter_.within(mode.mean_m, around_m) >= kKnown;
  is_sure_ = filter_.probabilityWithin(mode.mean_m, around_m) >= kSure;
  TrackerEstimate result;
  result.position_m = mode.mean_m;
  result.mode_covariance_m2 = mode.covariance_m2;
  result.cloud_covariance_m2 = filter_.covarianceAbout(mode.mean_m);
  result.spread_m = result.cloud_covariance_m2.diagonal().cwiseMax(0.0).cwiseSqrt();
  result.training_image = map_.nearest(mode.mean_m).image;
  result.best_image = result.training_image;
  for (const std::size_t image : chosen_) {
    const bool is_there = (map_.position_m(image) - mode.mean_m).norm() <= around_m;
    const Score score = is_there ? likelihood.of(image) : Score();
    if (score.similarity <= result.best.similarity) continue;
    result.best = score;
    result.best_image = image;
  }
  result.best_distance_m = (map_.position_m(result.best_image) - mode.mean_m).norm();
  result.report.set("speed_mps", filter_.speed_mps(result.training_image));
  return result;
}

/// By one random offset and equal steps through the posterior, so that all weigh the same.
void BayesTracker::drawParticles() {
  const double step = 1.0 / static_cast<double>(particles_.size());
  const auto places = filter_.probabilities().quantiles(random_.uniform(0.0, step), step, particles_.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    particles_[i] = Particle();
    particles_[i].position_m = filter_.places().position_m(places[i]);
    particles_[i].weight = step;
  }
}

}  // namespace visual_localization

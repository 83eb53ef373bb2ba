#include "localization/place_filter.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/numbers.h"

namespace visual_localization {

void BayesConfig::declare(ParameterVisitor& visitor) {
  visitor.real({"bayes/anywhere", "1", "probability that the next image is from anywhere in the map (kidnapping)"},
               anywhere, 1e-6, 0.5);
  visitor.real(
      {"bayes/exponent", "1",
       "matches plus one are raised to this to become a likelihood; 0: what suits the kind of features (SIFT 3, "
       "learned 2)"},
      exponent, 0.0, 20.0);
}

PlaceFilter::PlaceFilter(const TrainingMap& map, const BayesConfig& config)
    : map_(map),
      config_(config),
      pace_mps_(map.size()),
      probabilities_(map.size()),
      likelihoods_(map.size()),
      stayed_(map.size()),
      arrival_of_(map.size()) {
  learnPace();
  reset();
}

void PlaceFilter::reset() {
  std::fill(probabilities_.begin(), probabilities_.end(), 1.0 / static_cast<double>(map_.size()));
  forgetMotion();
  log_best_.reset();
  off_map_.reset();
}

void PlaceFilter::reset(const std::vector<Eigen::Vector2d>& positions_m) {
  reset();
  std::fill(probabilities_.begin(), probabilities_.end(), 0.0);
  for (const Eigen::Vector2d& position_m : positions_m) {
    probabilities_[map_.nearest(position_m).image] += 1.0 / static_cast<double>(positions_m.size());
  }
  off_map_.ruleOut();
}

double PlaceFilter::likelihoodOf(const Score& score) const {
  constexpr double kLeast = 1e-9;
  if (score.matches == 0 && score.weight > 0.0) return std::pow(std::max(kLeast, score.weight), independence_);
  const double exponent = config_.exponent > 0.0 ? config_.exponent : map_.header().kind->likelihoodExponent();
  return std::pow(static_cast<double>(score.matches) + 1.0, independence_ * exponent);
}

PlaceLikelihood::Compared PlaceFilter::comparedWith(std::size_t training_image, const Score& score) const {
  PlaceLikelihood::Compared compared{training_image, likelihoodOf(score)};
  if (score.matches > 0 || score.weight <= 0.0) {
    compared.log_matches = std::log(static_cast<double>(score.matches) + 1.0);
  }
  return compared;
}

PlaceLikelihood PlaceFilter::likelihoodBeside(const std::vector<Scores::Compared>& compared) {
  constexpr double kMemory = 0.95;
  constexpr double kChance = 0.25;  // most of what a tracker compares is near its estimate: the lowest tell of chance
  PlaceLikelihood likelihood;
  std::vector<double> values;
  for (const Scores::Compared& one : compared) {
    likelihood.compared.push_back(comparedWith(one.training_image, one.score));
    values.push_back(likelihood.compared.back().likelihood);
  }
  if (values.empty()) return likelihood;
  const double log_best = std::log(*std::max_element(values.begin(), values.end()));
  log_best_ = log_best_ ? std::max(log_best, kMemory * *log_best_ + (1.0 - kMemory) * log_best) : log_best;
  likelihood.elsewhere = std::exp(0.5 * (std::log(nearestRank(values, kChance)) + *log_best_));
  return likelihood;
}

void PlaceFilter::updateOffMap(const PlaceLikelihood& likelihood) {
  if (likelihood.is_verified) return off_map_.ruleOut();
  asked_.clear();
  std::vector<double> in_turn;
  const auto in_turn_from = likelihood.compared.begin() + static_cast<std::ptrdiff_t>(likelihood.asked_in_turn);
  for (auto one = likelihood.compared.begin(); one != likelihood.compared.end(); ++one) {
    if (!one->log_matches) continue;
    const bool is_in_turn = one >= in_turn_from;
    if (is_in_turn) in_turn.push_back(*one->log_matches);
    const auto is_same = [one](const auto& other) { return other.training_image == one->training_image; };
    if (is_in_turn && std::any_of(likelihood.compared.begin(), in_turn_from, is_same)) continue;  // it counts once
    asked_.push_back({probabilities_[one->training_image], *one->log_matches});
  }
  if (!off_map_.knowsChance() && !in_turn.empty()) off_map_.learnChance(median(std::move(in_turn)));
  off_map_.update(asked_);
}

/// Once the image says where the robot is: what matched there, and what matched far from it.
void PlaceFilter::learnMatches(const PlaceLikelihood& likelihood) {
  const auto most = std::max_element(probabilities_.begin(), probabilities_.end()) - probabilities_.begin();
  const Eigen::Vector2d place_m = map_.position_m(static_cast<std::size_t>(most));
  std::optional<double> best;
  for (std::size_t i = 0; i < likelihood.compared.size(); ++i) {
    const PlaceLikelihood::Compared& one = likelihood.compared[i];
    if (!one.log_matches) continue;
    const double distance_m = (map_.position_m(one.training_image) - place_m).norm();
    if (distance_m <= around_m()) best = std::max(best.value_or(0.0), *one.log_matches);
    if (distance_m > 2.0 * around_m() && i >= likelihood.asked_in_turn) off_map_.learnChance(*one.log_matches);
  }
  if (best) off_map_.learnUsual(*best, independence_ * within(place_m, around_m()));
}

void PlaceFilter::update(const PlaceLikelihood& likelihood) {
  updateOffMap(likelihood);
  const auto count = static_cast<double>(map_.size());
  std::fill(likelihoods_.begin(), likelihoods_.end(), likelihood.elsewhere);
  for (const auto& compared : likelihood.compared) likelihoods_[compared.training_image] = compared.likelihood;
  const double sum = std::accumulate(likelihoods_.begin(), likelihoods_.end(), 0.0);
  if (!(sum > 0.0) || !std::isfinite(sum)) return;
  for (double& value : likelihoods_) value = (1.0 - config_.uniform) * value / sum + config_.uniform / count;
  learnSpeed(std::inner_product(stayed_.begin(), stayed_.end(), likelihoods_.begin(), 0.0));
  double total = 0.0;
  for (std::size_t i = 0; i < likelihoods_.size(); ++i) total += probabilities_[i] *= likelihoods_[i];
  if (total > 0.0) {
    for (double& probability : probabilities_) probability /= total;
    learnMatches(likelihood);
  } else {
    reset();
  }
}

void PlaceFilter::mostProbable(std::size_t count, std::vector<std::size_t>& found) const {
  mostProbable(count, 0.0, found);
}

/// Those alone whose probability is at least `least`.
void PlaceFilter::mostProbable(std::size_t count, double least, std::vector<std::size_t>& found) const {
  const auto is_before = [this](std::size_t a, std::size_t b) {
    return probabilities_[a] != probabilities_[b] ? probabilities_[a] > probabilities_[b] : a < b;
  };
  found.clear();
  if (count == 0) return;
  for (std::size_t i = 0; i < probabilities_.size(); ++i) {  // the last one of a heap is at its front
    if (probabilities_[i] < least) continue;
    if (found.size() == count) {
      if (!is_before(i, found.front())) continue;
      std::pop_heap(found.begin(), found.end(), is_before);
      found.pop_back();
    }
    found.push_back(i);
    if (count < probabilities_.size()) std::push_heap(found.begin(), found.end(), is_before);
  }
}

double PlaceFilter::within(const Eigen::Vector2d& position_m, double radius_m) const {
  map_.within(position_m, radius_m, around_);
  double sum = 0.0;
  for (const std::uint32_t i : around_) sum += probabilities_[i];
  return sum;
}

PlaceLikelihood PlaceFilter::around(const Eigen::Vector2d& position_m) const {
  constexpr double kSigma_m = 1.0;
  constexpr double kFarthest = 8.0;  // sigmas
  const double sigma_m = std::max(kSigma_m, spacing_m_);
  PlaceLikelihood likelihood;
  likelihood.elsewhere = 0.0;
  likelihood.is_verified = true;
  const double nearest_m = map_.nearest(position_m).distance_m;
  map_.within(position_m, nearest_m + kFarthest * sigma_m, around_);
  for (const std::uint32_t i : around_) {
    const double distance_m = (map_.position_m(i) - position_m).norm();
    likelihood.compared.push_back({i, gaussian(distance_m - nearest_m, sigma_m)});
  }
  return likelihood;
}

CloudMoments PlaceFilter::mode() const {
  constexpr std::size_t kCandidates = 16;
  constexpr double kPlaces = 3.0;
  constexpr double kWidest_m = 5.0;
  const double radius_m = std::min(kWidest_m, kPlaces * spacing_m_);
  std::vector<std::size_t> candidates;
  mostProbable(kCandidates, candidates);
  std::sort(candidates.begin(), candidates.end());
  std::size_t best = candidates.front();
  double most = -1.0;
  for (const std::size_t candidate : candidates) {
    const double mass = within(map_.position_m(candidate), radius_m);
    if (mass > most) most = mass, best = candidate;
  }
  CloudMoments moments;
  double sum = 0.0;
  map_.within(map_.position_m(best), radius_m, around_);
  for (const std::uint32_t i : around_) {
    moments.mean_m += probabilities_[i] * map_.position_m(i);
    sum += probabilities_[i];
  }
  if (!(sum > 0.0)) return {map_.position_m(best), Eigen::Matrix2d::Zero()};
  moments.mean_m /= sum;
  for (const std::uint32_t i : around_) {
    const Eigen::Vector2d offset_m = map_.position_m(i) - moments.mean_m;
    moments.covariance_m2 += probabilities_[i] / sum * offset_m * offset_m.transpose();
  }
  return moments;
}

Eigen::Matrix2d PlaceFilter::covarianceAbout(const Eigen::Vector2d& centre_m) const {
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();
  for (std::size_t i = 0; i < probabilities_.size(); ++i) {
    const Eigen::Vector2d offset_m = map_.position_m(i) - centre_m;
    covariance_m2 += probabilities_[i] * offset_m * offset_m.transpose();
  }
  return covariance_m2;
}

}  // namespace visual_localization

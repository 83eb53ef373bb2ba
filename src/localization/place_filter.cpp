#include "localization/place_filter.h"

#include <algorithm>
#include <cmath>

#include "base/numbers.h"

namespace visual_localization {

void BayesConfig::declare(ParameterVisitor& visitor) {
  visitor.real({"bayes/anywhere", "1",
                "probability that the next image is from anywhere in the map (kidnapping); less where images follow "
                "each other more closely than training images"},
               anywhere, 1e-6, 0.5);
}

PlaceFilter::PlaceFilter(const TrainingMap& map, const BayesConfig& config)
    : map_(map), config_(config), pace_mps_(map.size()), where_(map, learnPace(), around_m()), places_(where_.size()) {
  learnMoments();
  reset();
}

void PlaceFilter::learnMoments() {
  const auto count = static_cast<double>(where_.size());
  for (std::size_t i = 0; i < where_.size(); ++i) centroid_m_ += where_.position_m(i) / count;
  for (std::size_t i = 0; i < where_.size(); ++i) {
    const Eigen::Vector2d offset_m = where_.position_m(i) - centroid_m_;
    scatter_m2_ += offset_m * offset_m.transpose();
  }
}

void PlaceFilter::reset() {
  places_.reset(1.0 / static_cast<double>(where_.size()));
  forgetMotion();
  log_best_.reset();
  off_map_.reset();
}

void PlaceFilter::reset(const std::vector<Eigen::Vector2d>& positions_m) {
  reset();
  places_.reset(0.0);
  for (const Eigen::Vector2d& position_m : positions_m) {
    places_.own(where_.nearest(position_m).image).probability += 1.0 / static_cast<double>(positions_m.size());
  }
  off_map_.settle(true);
}

double PlaceFilter::likelihoodOf(const Score& score) const {
  constexpr double kLeast = 1e-9;
  if (score.matches == 0 && score.weight > 0.0) return std::pow(std::max(kLeast, score.weight), independence_);
  const double exponent = map_.header().kind->likelihoodExponent();
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
  if (likelihood.is_verified) return off_map_.settle(!likelihood.is_aside);
  asked_.clear();
  std::vector<double> in_turn;
  const auto in_turn_from = likelihood.compared.begin() + static_cast<std::ptrdiff_t>(likelihood.asked_in_turn);
  for (auto one = likelihood.compared.begin(); one != likelihood.compared.end(); ++one) {
    if (!one->log_matches) continue;
    const bool is_in_turn = one >= in_turn_from;
    if (is_in_turn) in_turn.push_back(*one->log_matches);
    const auto is_same = [one](const auto& other) { return other.training_image == one->training_image; };
    if (is_in_turn && std::any_of(likelihood.compared.begin(), in_turn_from, is_same)) continue;  // it counts once
    asked_.push_back({places_[one->training_image], *one->log_matches, beyond(one->training_image)});
  }
  if (!off_map_.knowsChance() && !in_turn.empty()) off_map_.learnChance(median(std::move(in_turn)));
  off_map_.update(asked_);
}

/// Probability of the places beyond a training image.
double PlaceFilter::beyond(std::size_t training_image) const {
  const auto [first, last] = where_.beyond(training_image);
  double sum = 0.0;
  for (std::size_t place = first; place < last; ++place) sum += places_[place];
  return sum;
}

/// Of all places that have no image.
double PlaceFilter::beyond() const {
  double sum = 0.0;
  for (std::size_t place = map_.size(); place < where_.size(); ++place) sum += places_[place];
  return sum;
}

double PlaceFilter::offMap() const { return 1.0 - (1.0 - off_map_.probability()) * (1.0 - beyond()); }

/// Once the image says where the robot is: what matched there, and what matched far from it.
void PlaceFilter::learnMatches(const PlaceLikelihood& likelihood) {
  std::vector<std::size_t> most;
  places_.mostProbable(1, 0.0, most);
  if (!where_.hasImage(most.front())) return;
  const Eigen::Vector2d place_m = map_.position_m(most.front());
  std::optional<double> best;
  for (std::size_t i = 0; i < likelihood.compared.size(); ++i) {
    const PlaceLikelihood::Compared& one = likelihood.compared[i];
    if (!one.log_matches) continue;
    const double distance_m = (map_.position_m(one.training_image) - place_m).norm();
    if (distance_m <= around_m()) best = std::max(best.value_or(0.0), *one.log_matches);
    if (distance_m > 2.0 * around_m() && i >= likelihood.asked_in_turn) off_map_.learnChance(*one.log_matches);
  }
  if (best) off_map_.learnUsual(*best, independence_ * (1.0 - beyond()) * within(place_m, around_m()));
}

/// Places beyond a training image never match better than it. Fewer matches than usual tell against the image itself,
/// as many as usual against the places beyond.
void PlaceFilter::setLikelihoodBeyond(const PlaceLikelihood::Compared& compared) {
  const auto [first, last] = where_.beyond(compared.training_image);
  if (first == last) return;
  const double all = compared.log_matches ? off_map_.beyondRatio(*compared.log_matches) : 1.0;
  const double ratio = std::pow(all, independence_);
  places_.own(compared.training_image).likelihood = compared.likelihood * std::min(1.0, 1.0 / ratio);
  for (std::size_t place = first; place < last; ++place) {
    places_.own(place).likelihood = compared.likelihood * std::min(1.0, ratio);
  }
}

void PlaceFilter::update(const PlaceLikelihood& likelihood) {
  updateOffMap(likelihood);
  using Place = PlaceProbabilities::Own;
  places_.forEach([&](Place& place) { place.likelihood = likelihood.elsewhere; });
  for (const auto& compared : likelihood.compared) {
    places_.own(compared.training_image).likelihood = compared.likelihood;
    if (!likelihood.is_verified) setLikelihoodBeyond(compared);
  }
  const double sum = places_.sum([](const Place& place) { return place.likelihood; });
  if (!(sum > 0.0) || !std::isfinite(sum)) return;
  const double uniform = config_.uniform / static_cast<double>(where_.size());
  places_.forEach([&](Place& place) { place.likelihood = (1.0 - config_.uniform) * place.likelihood / sum + uniform; });
  learnSpeed(places_.sum([](const Place& place) { return place.stayed * place.likelihood; }));
  places_.forEach([](Place& place) { place.probability *= place.likelihood; });
  const double total = places_.sum([](const Place& place) { return place.probability; });
  if (!(total > 0.0)) return reset();
  places_.forEach([total](Place& place) { place.probability /= total; });
  places_.joinAlike();
  learnMatches(likelihood);
}

double PlaceFilter::within(const Eigen::Vector2d& position_m, double radius_m) const {
  where_.within(position_m, radius_m, around_);
  double sum = 0.0;
  for (const std::uint32_t i : around_) sum += places_[i];
  return sum;
}

PlaceLikelihood PlaceFilter::around(const Eigen::Vector2d& position_m, const std::optional<Fitness>& seen) const {
  constexpr double kSigma_m = 1.0;
  constexpr double kFarthest = 8.0;  // sigmas
  const double sigma_m = std::max(kSigma_m, spacing_m_);
  PlaceLikelihood likelihood;
  likelihood.elsewhere = 0.0;
  likelihood.is_verified = true;
  const double nearest_m = where_.nearest(position_m).distance_m;
  likelihood.is_aside = nearest_m > around_m();
  where_.within(position_m, nearest_m + kFarthest * sigma_m, around_);
  for (const std::uint32_t i : around_) {
    const double distance_m = (where_.position_m(i) - position_m).norm();
    likelihood.compared.push_back({i, gaussian(distance_m - nearest_m, sigma_m)});
    if (seen && seen->training_image == i) {
      likelihood.compared.back().log_matches = comparedWith(i, seen->score).log_matches;
    }
  }
  return likelihood;
}

std::vector<std::size_t> PlaceFilter::mostProbableImages(std::size_t count) const {
  constexpr std::size_t kBeyond = 256;  // places beyond the ends that may be among the most probable
  std::vector<std::size_t> places;
  places_.mostProbable(count + kBeyond, 0.0, places);
  std::sort(places.begin(), places.end(), [this](std::size_t a, std::size_t b) {
    return places_[a] != places_[b] ? places_[a] > places_[b] : a < b;
  });
  std::vector<std::size_t> images;
  for (auto place = places.begin(); place != places.end() && images.size() < count; ++place) {
    const std::size_t image = where_.image(*place);
    if (std::find(images.begin(), images.end(), image) == images.end()) images.push_back(image);
  }
  return images;
}

CloudMoments PlaceFilter::mode() const {
  constexpr std::size_t kCandidates = 16;
  const double radius_m = around_m();
  std::vector<std::size_t> candidates;
  places_.mostProbable(kCandidates, 0.0, candidates);
  std::sort(candidates.begin(), candidates.end());
  std::size_t best = where_.image(candidates.front());
  double most = -1.0;
  for (const std::size_t place : candidates) {
    const std::size_t candidate = where_.image(place);
    const double mass = within(map_.position_m(candidate), radius_m);
    if (mass > most) most = mass, best = candidate;
  }
  const Eigen::Matrix2d between_m2 = spacing_m_ * spacing_m_ / 12.0 * Eigen::Matrix2d::Identity();
  CloudMoments moments;
  double sum = 0.0;
  where_.within(map_.position_m(best), radius_m, around_);
  for (const std::uint32_t i : around_) {
    moments.mean_m += places_[i] * where_.position_m(i);
    sum += places_[i];
  }
  if (!(sum > 0.0)) return {map_.position_m(best), between_m2};
  moments.mean_m /= sum;
  moments.covariance_m2 = between_m2;
  for (const std::uint32_t i : around_) {
    const Eigen::Vector2d offset_m = where_.position_m(i) - moments.mean_m;
    moments.covariance_m2 += places_[i] / sum * offset_m * offset_m.transpose();
  }
  return moments;
}

Eigen::Matrix2d PlaceFilter::covarianceAbout(const Eigen::Vector2d& centre_m) const {
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();
  const double common = places_.commonCount() > 0 ? places_.common().probability : 0.0;
  for (const PlaceProbabilities::Own& place : places_.allOwn()) {
    const Eigen::Vector2d offset_m = where_.position_m(place.training_image) - centre_m;
    covariance_m2 += (place.probability - common) * offset_m * offset_m.transpose();
  }
  const Eigen::Vector2d offset_m = centroid_m_ - centre_m;
  const auto count = static_cast<double>(where_.size());
  return covariance_m2 + common * (scatter_m2_ + count * offset_m * offset_m.transpose());
}

}  // namespace visual_localization

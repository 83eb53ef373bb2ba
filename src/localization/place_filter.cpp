#include "localization/place_filter.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/numbers.h"
#include "base/time.h"

namespace visual_localization {
namespace {

constexpr double kSpeedSigma = 0.5;     ///< of the logarithm of the speed, as a share of the session's
constexpr double kStands = 0.05;        ///< how likely the robot stands
constexpr double kReverses = 0.02;      ///< or drives backwards
constexpr double kSpeedMemory = 0.95;   ///< what is left of the knowledge of the speed after an image
constexpr double kDistanceSigma = 0.2;  ///< of a distance at a known speed, as a share: half the step to the next speed
constexpr double kPlaceSigma = 0.3;     ///< of where a place is seen best, share of the spacing
constexpr double kSlowest = 0.3;        ///< pace of a session that stood, share of its usual one
constexpr double kFastest = 3.0;
constexpr double kLeastSpacing_m = 0.05;
constexpr double kLongest_s = 60.0;       ///< a longer way is no better known
constexpr std::size_t kMostMoved = 4096;  ///< training images from which the robot is moved, the most probable ones
constexpr double kLeastMoved = 1e-4;      ///< and only such as have this share of the largest probability
constexpr std::size_t kMostAround = 512;  ///< training images that it may come to from one

PlaceFilter::PerSpeed usualSpeeds() {
  PlaceFilter::PerSpeed usual{};
  double sum = 0.0;
  for (std::size_t k = 0; k < usual.size(); ++k) {
    if (PlaceFilter::kSpeeds[k] <= 0.0) continue;
    const double deviation = std::log(PlaceFilter::kSpeeds[k]) / kSpeedSigma;
    sum += usual[k] = std::exp(-0.5 * deviation * deviation);
  }
  for (double& share : usual) share *= (1.0 - kStands - kReverses) / sum;
  usual[0] = kReverses;
  usual[1] = kStands;
  return usual;
}

double gaussian(double deviation, double sigma) { return std::exp(-0.5 * deviation * deviation / (sigma * sigma)); }

}  // namespace

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

double PlaceFilter::secondsOf(const Motion& motion) const {
  return std::min(motion.seconds() > 0.0 ? motion.seconds() : interval_s_, kLongest_s);
}

/// A robot is likely to be slow where the session was.
void PlaceFilter::learnPace() {
  std::vector<double> gaps_m;
  std::vector<double> intervals_s;
  std::vector<double> paces_mps;
  for (std::size_t i = 0; i + 1 < map_.size(); ++i) {
    const TrainingPose here = map_.pose(i);
    const TrainingPose next = map_.pose(i + 1);
    const double gap_m = (next.position_m - here.position_m).norm();
    const double interval_s = secondsBetween(here.stamp_ns, next.stamp_ns);
    pace_mps_[i] = -1.0F;
    if (here.session != next.session || !(interval_s > 0.0) || interval_s > kLongest_s) continue;
    pace_mps_[i] = static_cast<float>(gap_m / interval_s);
    intervals_s.push_back(interval_s);
    if (gap_m <= 0.0) continue;
    gaps_m.push_back(gap_m);
    paces_mps.push_back(gap_m / interval_s);
  }
  pace_mps_.back() = -1.0F;
  if (!gaps_m.empty()) spacing_m_ = std::max(kLeastSpacing_m, median(gaps_m));
  if (!intervals_s.empty()) interval_s_ = median(intervals_s);
  const double usual_mps = paces_mps.empty() ? spacing_m_ / interval_s_ : median(paces_mps);
  for (float& pace_mps : pace_mps_) {
    const double known_mps = pace_mps < 0.0F ? usual_mps : static_cast<double>(pace_mps);
    pace_mps = static_cast<float>(std::clamp(known_mps, kSlowest * usual_mps, kFastest * usual_mps));
  }
}

void PlaceFilter::reset() {
  std::fill(probabilities_.begin(), probabilities_.end(), 1.0 / static_cast<double>(map_.size()));
  speeds_ = usualSpeeds();
  independence_ = 1.0;
  log_best_.reset();
  arrivals_.clear();
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

PlaceFilter::Arrival& PlaceFilter::arrivalAt(std::size_t image) {
  std::uint32_t& arrival = arrival_of_[image];
  if (arrival < arrivals_.size() && arrivals_[arrival].training_image == image) return arrivals_[arrival];
  arrival = static_cast<std::uint32_t>(arrivals_.size());
  arrivals_.emplace_back();
  arrivals_.back().training_image = image;
  return arrivals_.back();
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

void PlaceFilter::predict(const Motion& motion) {
  constexpr double kLeastIndependence = 0.1;  // of a robot that stands: noise, and people who pass
  const double expected_m = expectedSpeed() * spacing_m_ / interval_s_ * secondsOf(motion);
  const double way_m = motion.share() > 0.0 ? motion.increment().distance_m : expected_m;
  independence_ = std::clamp(way_m / spacing_m_, kLeastIndependence, 1.0);
  arrivals_.clear();
  leaving_ = 0.0;
  stayed_ = probabilities_;
  const double least = kLeastMoved * *std::max_element(probabilities_.begin(), probabilities_.end());
  std::vector<std::size_t> moved;
  mostProbable(kMostMoved, moved);
  for (const std::size_t image : moved) {
    if (probabilities_[image] < least || probabilities_[image] <= 0.0) continue;
    moveFrom(image, motion);
    stayed_[image] = 0.0;
  }
  off_map_.predict(leaving_);
  const PerSpeed usual = usualSpeeds();
  double sum = 0.0;
  for (std::size_t k = 0; k < speeds_.size(); ++k) {
    sum += speeds_[k] = std::pow(speeds_[k], kSpeedMemory) * std::pow(usual[k], 1.0 - kSpeedMemory);
  }
  for (double& speed : speeds_) speed /= sum;
  probabilities_ = stayed_;
  for (const Arrival& arrival : arrivals_) {
    const double by_speed =
        std::inner_product(speeds_.begin(), speeds_.end(), arrival.by_speed.begin(), 0.0) * (1.0 - motion.share());
    probabilities_[arrival.training_image] += by_speed + motion.share() * arrival.by_odometry;
  }
  const double anywhere = config_.anywhere / static_cast<double>(map_.size());
  for (double& probability : probabilities_) probability = (1.0 - config_.anywhere) * probability + anywhere;
}

/// A Gaussian about where each speed leads to, shared among the training images that face alike.
void PlaceFilter::moveFrom(std::size_t image, const Motion& motion) {
  const double pace_m = static_cast<double>(pace_mps_[image]) * secondsOf(motion);
  const double place_m = kPlaceSigma * spacing_m_;
  const double longest_m = std::max(kSpeeds.back() * pace_m, motion.increment().distance_m);
  const auto sessions = static_cast<double>(map_.header().sessions.size());
  const double most = std::min(std::ceil(3.0 * sessions * (1.0 + longest_m / spacing_m_)), 1.0 * kMostAround);
  map_.nearest(map_.position_m(image), static_cast<std::size_t>(most), neighbours_);
  leaving_ += probabilities_[image] * leavingFrom(image, motion);
  const double yaw_rad = map_.yaw_rad(image);
  const Eigen::Vector2d heading(std::cos(yaw_rad), std::sin(yaw_rad));
  ahead_m_.clear();
  std::size_t facing = 0;
  for (const Neighbour& neighbour : neighbours_) {
    if (!faceAlike(yaw_rad, map_.yaw_rad(neighbour.image)) && neighbour.image != image) continue;
    const double along_m = heading.dot(map_.position_m(neighbour.image) - map_.position_m(image));
    ahead_m_.push_back(std::copysign(neighbour.distance_m, along_m));
    neighbours_[facing++] = neighbour;
  }
  neighbours_.resize(facing);
  const double probability = probabilities_[image];
  const auto share = [&](double distance_m, double sigma_m, auto add) {
    kernel_.clear();
    for (const double ahead_m : ahead_m_) kernel_.push_back(gaussian(ahead_m - distance_m, sigma_m));
    const double sum = std::accumulate(kernel_.begin(), kernel_.end(), 0.0);
    if (sum < 1e-100) return add(arrivalAt(image), probability);  // none is there
    for (std::size_t i = 0; i < kernel_.size(); ++i) {
      const double part = kernel_[i] / sum;
      if (part > 1e-12) add(arrivalAt(neighbours_[i].image), probability * part);
    }
  };
  for (std::size_t k = 0; k < kSpeeds.size(); ++k) {
    const double distance_m = kSpeeds[k] * pace_m;
    share(distance_m, std::hypot(kDistanceSigma * distance_m, place_m),
          [k](Arrival& arrival, double part) { arrival.by_speed[k] += part; });
  }
  if (motion.share() <= 0.0) return;
  const Eigen::Vector2d& way_m = motion.increment().translation_m;
  share(std::copysign(way_m.norm(), way_m.x()), std::hypot(motion.sigma_m(), place_m),
        [](Arrival& arrival, double part) { arrival.by_odometry += part; });
}

/// How likely the motion leads beyond the training images around one, all of which are in `neighbours_`.
double PlaceFilter::leavingFrom(std::size_t image, const Motion& motion) const {
  constexpr double kAhead = -0.5;  // cosine: what a sharp bend leads to is not beside the path
  const double known_m = neighbours_.size() < map_.size() ? neighbours_.back().distance_m : 1e300;
  const Eigen::Vector2d here_m = map_.position_m(image);
  const Eigen::Vector2d heading(std::cos(map_.yaw_rad(image)), std::sin(map_.yaw_rad(image)));
  double ahead_m = 0.0;
  double behind_m = 0.0;
  for (const Neighbour& neighbour : neighbours_) {
    const double along_m = heading.dot(map_.position_m(neighbour.image) - here_m);
    if (along_m >= kAhead * neighbour.distance_m) ahead_m = std::max(ahead_m, neighbour.distance_m);
    if (-along_m >= kAhead * neighbour.distance_m) behind_m = std::max(behind_m, neighbour.distance_m);
  }
  const auto beyond = [&](double distance_m, double sigma_m) {
    if (distance_m == 0.0 || std::abs(distance_m) > known_m) return 0.0;
    const double path_m = (distance_m > 0.0 ? ahead_m : behind_m) + 0.5 * spacing_m_;
    return 0.5 * std::erfc((path_m - std::abs(distance_m)) / (std::sqrt(2.0) * sigma_m));
  };
  const double pace_m = static_cast<double>(pace_mps_[image]) * secondsOf(motion);
  const double place_m = kPlaceSigma * spacing_m_;
  double leaving = 0.0;
  for (std::size_t k = 0; k < kSpeeds.size(); ++k) {
    const double distance_m = kSpeeds[k] * pace_m;
    leaving += speeds_[k] * beyond(distance_m, std::hypot(kDistanceSigma * distance_m, place_m));
  }
  const Eigen::Vector2d& way_m = motion.increment().translation_m;
  const double by_odometry = motion.share() > 0.0
                                 ? beyond(std::copysign(way_m.norm(), way_m.x()), std::hypot(motion.sigma_m(), place_m))
                                 : 0.0;
  return (1.0 - motion.share()) * leaving + motion.share() * by_odometry;
}

void PlaceFilter::updateOffMap(const PlaceLikelihood& likelihood) {
  if (likelihood.is_verified) return off_map_.ruleOut();
  asked_.clear();
  std::vector<double> in_turn;
  for (std::size_t i = 0; i < likelihood.compared.size(); ++i) {
    const PlaceLikelihood::Compared& one = likelihood.compared[i];
    if (!one.log_matches) continue;
    asked_.push_back({probabilities_[one.training_image], *one.log_matches});
    if (i >= likelihood.asked_in_turn) in_turn.push_back(*one.log_matches);
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

/// By how well each predicted the image. `elsewhere`: where none was asked.
void PlaceFilter::learnSpeed(double elsewhere) {
  if (arrivals_.empty()) return;
  PerSpeed evidence{};
  evidence.fill(elsewhere);
  for (const Arrival& arrival : arrivals_) {
    for (std::size_t k = 0; k < evidence.size(); ++k) {
      evidence[k] += arrival.by_speed[k] * likelihoods_[arrival.training_image];
    }
  }
  const double sum = std::inner_product(speeds_.begin(), speeds_.end(), evidence.begin(), 0.0);
  if (!(sum > 0.0)) return;
  for (std::size_t k = 0; k < speeds_.size(); ++k) speeds_[k] *= evidence[k] / sum;
}

void PlaceFilter::mostProbable(std::size_t count, std::vector<std::size_t>& found) const {
  found.resize(map_.size());
  std::iota(found.begin(), found.end(), std::size_t{0});
  if (count >= found.size()) return;
  std::nth_element(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count), found.end(),
                   [this](std::size_t a, std::size_t b) {
                     return probabilities_[a] != probabilities_[b] ? probabilities_[a] > probabilities_[b] : a < b;
                   });
  found.resize(count);
}

double PlaceFilter::within(const Eigen::Vector2d& position_m, double radius_m) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < probabilities_.size(); ++i) {
    if ((map_.position_m(i) - position_m).norm() <= radius_m) sum += probabilities_[i];
  }
  return sum;
}

PlaceLikelihood PlaceFilter::around(const Eigen::Vector2d& position_m) const {
  constexpr double kSigma_m = 1.0;
  const double sigma_m = std::max(kSigma_m, spacing_m_);
  PlaceLikelihood likelihood;
  likelihood.elsewhere = 0.0;
  likelihood.is_verified = true;
  const double nearest_m = map_.nearest(position_m).distance_m;
  for (std::size_t i = 0; i < map_.size(); ++i) {
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
  const auto forEachThere = [&](auto use) {
    for (std::size_t i = 0; i < probabilities_.size(); ++i) {
      if ((map_.position_m(i) - map_.position_m(best)).norm() <= radius_m) use(probabilities_[i], map_.position_m(i));
    }
  };
  forEachThere([&](double probability, const Eigen::Vector2d& position_m) {
    moments.mean_m += probability * position_m;
    sum += probability;
  });
  if (!(sum > 0.0)) return {map_.position_m(best), Eigen::Matrix2d::Zero()};
  moments.mean_m /= sum;
  forEachThere([&](double probability, const Eigen::Vector2d& position_m) {
    const Eigen::Vector2d offset_m = position_m - moments.mean_m;
    moments.covariance_m2 += probability / sum * offset_m * offset_m.transpose();
  });
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

/// As a share of the session's.
double PlaceFilter::expectedSpeed() const {
  return std::max(0.0, std::inner_product(speeds_.begin(), speeds_.end(), kSpeeds.begin(), 0.0));
}

double PlaceFilter::speed_mps(std::size_t training_image) const {
  return expectedSpeed() * static_cast<double>(pace_mps_[training_image]);
}

}  // namespace visual_localization

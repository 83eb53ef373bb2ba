// How PlaceFilter moves the robot from training image to training image, and beyond them.

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/numbers.h"
#include "base/time.h"
#include "localization/place_filter.h"

namespace visual_localization {
namespace {

constexpr double kSpeedSigma = 0.5;    ///< of the logarithm of the speed, as a share of the session's
constexpr double kStands = 0.05;       ///< how likely the robot stands
constexpr double kReverses = 0.02;     ///< or drives backwards
constexpr double kSpeedMemory = 0.95;  ///< what is left of the knowledge of the speed after an image
// How far odometry is believed is learnt, as how well each speed predicted the images.
constexpr double kSlips = 0.02;         ///< an image, wheels slip although odometry is right
constexpr double kBreaks = 0.002;       ///< an image, it goes wrong for long
constexpr double kMends = 0.02;         ///< and comes right again
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

}  // namespace

double PlaceFilter::secondsOf(const Motion& motion) const {
  return std::min(motion.seconds() > 0.0 ? motion.seconds() : interval_s_, kLongest_s);
}

/// A robot is likely to be slow where the session was. Returns the spacing.
double PlaceFilter::learnPace() {
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
  return spacing_m_;
}

void PlaceFilter::forgetMotion() {
  speeds_ = usualSpeeds();
  independence_ = 1.0;
  arrivals_.clear();
}

PlaceFilter::Arrival& PlaceFilter::arrivalAt(std::size_t image) {
  PlaceProbabilities::Own& place = places_.own(image);
  if (place.arrival != PlaceProbabilities::kNone) return arrivals_[place.arrival];
  place.arrival = static_cast<std::uint32_t>(arrivals_.size());
  arrivals_.emplace_back();
  arrivals_.back().training_image = place.training_image;
  return arrivals_.back();
}

PlaceFilter::Way PlaceFilter::wayAt(double speed, std::size_t place, const Motion& motion) const {
  const double distance_m = speed * static_cast<double>(pace_mps_[where_.image(place)]) * secondsOf(motion);
  return {distance_m, std::hypot(kDistanceSigma * distance_m, kPlaceSigma * spacing_m_)};
}

PlaceFilter::Way PlaceFilter::wayBy(const Motion& motion) const {
  const Eigen::Vector2d& way_m = motion.increment().translation_m;
  return {std::copysign(way_m.norm(), way_m.x()), std::hypot(motion.sigma_m(), kPlaceSigma * spacing_m_)};
}

void PlaceFilter::predict(const Motion& motion) {
  using Place = PlaceProbabilities::Own;
  constexpr double kLeastIndependence = 0.1;  // of a robot that stands: noise, and people who pass
  double expected = 0.0;                      // forwards or backwards, as a share of the session's speed
  for (std::size_t k = 0; k < speeds_.size(); ++k) expected += speeds_[k] * std::abs(kSpeeds[k]);
  const double expected_m = expected * spacing_m_ / interval_s_ * secondsOf(motion);
  const double way_m = motion.share() > 0.0 ? motion.increment().distance_m : expected_m;
  independence_ = std::clamp(way_m / spacing_m_, kLeastIndependence, 1.0);
  arrivals_.clear();
  leaving_ = 0.0;
  if (motion.share() > 0.0) {
    const double before = odometry_.value_or(motion.share());
    odometry_ = before * (1.0 - kBreaks) + (1.0 - before) * kMends;
  }
  const double followed = motion.share() > 0.0 ? followedShare() : 0.0;
  places_.forEach([](Place& place) {
    place.stayed = place.probability;
    place.arrival = PlaceProbabilities::kNone;
  });
  std::vector<std::size_t> moved;
  places_.mostProbable(1, 0.0, moved);
  places_.mostProbable(kMostMoved, kLeastMoved * places_[moved.front()], moved);
  for (const std::size_t image : moved) {
    // A part of what is common is not moved: all of it, moved alike, would be what it was.
    if (places_[image] <= 0.0 || (where_.size() > kMostMoved && places_.isCommon(image))) continue;
    moveFrom(image, motion);
    places_.own(image).stayed = 0.0;
  }
  off_map_.predict(leaving_);
  const PerSpeed usual = usualSpeeds();
  double sum = 0.0;
  for (std::size_t k = 0; k < speeds_.size(); ++k) {
    sum += speeds_[k] = std::pow(speeds_[k], kSpeedMemory) * std::pow(usual[k], 1.0 - kSpeedMemory);
  }
  for (double& speed : speeds_) speed /= sum;
  const double carried_away = independence_ * config_.anywhere;
  const double anywhere = carried_away / static_cast<double>(where_.size());
  places_.forEach([&](Place& place) {
    place.probability = place.stayed;
    if (place.arrival != PlaceProbabilities::kNone) {
      const Arrival& arrival = arrivals_[place.arrival];
      const double by_speed = std::inner_product(speeds_.begin(), speeds_.end(), arrival.by_speed.begin(), 0.0);
      place.probability += (1.0 - followed) * by_speed + followed * arrival.by_odometry;
    }
    place.probability = (1.0 - carried_away) * place.probability + anywhere;
  });
}

/// A Gaussian about where each speed leads to, shared among the training images that face alike.
void PlaceFilter::moveFrom(std::size_t image, const Motion& motion) {
  const double longest_m = std::max(wayAt(kSpeeds.back(), image, motion).distance_m, motion.increment().distance_m);
  const auto sessions = static_cast<double>(map_.header().sessions.size());
  const double most = std::min(std::ceil(3.0 * sessions * (1.0 + longest_m / spacing_m_)), 1.0 * kMostAround);
  where_.nearest(where_.position_m(image), static_cast<std::size_t>(most), neighbours_);
  const double probability = places_[image];
  leaving_ += probability * leavingFrom(image, motion);
  const double yaw_rad = where_.yaw_rad(image);
  const Eigen::Vector2d heading(std::cos(yaw_rad), std::sin(yaw_rad));
  ahead_m_.clear();
  std::size_t facing = 0;
  for (const Neighbour& neighbour : neighbours_) {
    if (!faceAlike(yaw_rad, where_.yaw_rad(neighbour.image)) && neighbour.image != image) continue;
    const double along_m = heading.dot(where_.position_m(neighbour.image) - where_.position_m(image));
    ahead_m_.push_back(std::copysign(neighbour.distance_m, along_m));
    neighbours_[facing++] = neighbour;
  }
  neighbours_.resize(facing);
  const auto share = [&](const Way& way, auto add) {
    kernel_.clear();
    for (const double ahead_m : ahead_m_) kernel_.push_back(gaussian(ahead_m - way.distance_m, way.sigma_m));
    const double sum = std::accumulate(kernel_.begin(), kernel_.end(), 0.0);
    if (sum < 1e-100) return add(arrivalAt(image), probability);  // none is there
    for (std::size_t i = 0; i < kernel_.size(); ++i) {
      const double part = kernel_[i] / sum;
      if (part > 1e-12) add(arrivalAt(neighbours_[i].image), probability * part);
    }
  };
  for (std::size_t k = 0; k < kSpeeds.size(); ++k) {
    share(wayAt(kSpeeds[k], image, motion), [k](Arrival& arrival, double part) { arrival.by_speed[k] += part; });
  }
  if (motion.share() <= 0.0) return;
  share(wayBy(motion), [](Arrival& arrival, double part) { arrival.by_odometry += part; });
}

/// How likely the motion leads beyond the training images around one, all of which are in `neighbours_`.
double PlaceFilter::leavingFrom(std::size_t image, const Motion& motion) const {
  constexpr double kAhead = -0.5;  // cosine: what a sharp bend leads to is not beside the path
  const double known_m = neighbours_.size() < where_.size() ? neighbours_.back().distance_m : 1e300;
  const Eigen::Vector2d here_m = where_.position_m(image);
  const Eigen::Vector2d heading(std::cos(where_.yaw_rad(image)), std::sin(where_.yaw_rad(image)));
  double ahead_m = 0.0;
  double behind_m = 0.0;
  for (const Neighbour& neighbour : neighbours_) {
    const double along_m = heading.dot(where_.position_m(neighbour.image) - here_m);
    if (along_m >= kAhead * neighbour.distance_m) ahead_m = std::max(ahead_m, neighbour.distance_m);
    if (-along_m >= kAhead * neighbour.distance_m) behind_m = std::max(behind_m, neighbour.distance_m);
  }
  const auto beyond = [&](const Way& way) {
    const double distance_m = std::abs(way.distance_m);
    if (distance_m == 0.0 || distance_m > known_m) return 0.0;
    const double path_m = (way.distance_m > 0.0 ? ahead_m : behind_m) + 0.5 * spacing_m_;
    return 0.5 * std::erfc((path_m - distance_m) / (std::sqrt(2.0) * way.sigma_m));
  };
  double leaving = 0.0;
  for (std::size_t k = 0; k < kSpeeds.size(); ++k) leaving += speeds_[k] * beyond(wayAt(kSpeeds[k], image, motion));
  if (motion.share() <= 0.0) return leaving;
  return (1.0 - followedShare()) * leaving + followedShare() * beyond(wayBy(motion));
}

/// Of the hypotheses, those that odometry moves.
double PlaceFilter::followedShare() const { return (1.0 - kSlips) * odometry_.value_or(0.0); }

/// By how well each predicted the image. `elsewhere`: where none was asked.
void PlaceFilter::learnSpeed(double elsewhere) {
  if (arrivals_.empty()) return;
  PerSpeed evidence{};
  evidence.fill(elsewhere);
  double of_odometry = elsewhere;
  bool by_odometry = false;
  for (const Arrival& arrival : arrivals_) {
    const double likelihood = places_.own(arrival.training_image).likelihood;
    for (std::size_t k = 0; k < evidence.size(); ++k) evidence[k] += arrival.by_speed[k] * likelihood;
    of_odometry += arrival.by_odometry * likelihood;
    by_odometry = by_odometry || arrival.by_odometry > 0.0;
  }
  const double sum = std::inner_product(speeds_.begin(), speeds_.end(), evidence.begin(), 0.0);
  if (!(sum > 0.0)) return;
  for (std::size_t k = 0; k < speeds_.size(); ++k) speeds_[k] *= evidence[k] / sum;
  if (by_odometry) odometry_ = *odometry_ * of_odometry / (*odometry_ * of_odometry + (1.0 - *odometry_) * sum);
}

/// As a share of the session's.
double PlaceFilter::expectedSpeed() const {
  return std::max(0.0, std::inner_product(speeds_.begin(), speeds_.end(), kSpeeds.begin(), 0.0));
}

double PlaceFilter::speed_mps(std::size_t training_image) const {
  return expectedSpeed() * static_cast<double>(pace_mps_[training_image]);
}

}  // namespace visual_localization

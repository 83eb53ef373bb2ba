#include "localization/session_choice.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "base/numbers.h"
#include "base/time.h"
#include "map/map_geometry.h"

namespace visual_localization {
namespace {

constexpr double kReach_m = 3.0;         ///< a session whose nearest image is so much farther away was not there
constexpr std::size_t kTrialEvery = 4;   ///< images
constexpr std::size_t kPatience = 3;     ///< images that show nothing
constexpr double kMemory = 0.7;          ///< share of what was known of a session before its last trial
constexpr double kBetter = 1.1;          ///< another session must match so much better
constexpr double kLeastMatch = 0.01;     ///< added to both: of what hardly matches no ratio is known
constexpr double kLargestRatio = 10.0;   ///< of two matches: one image alone must not decide
constexpr double kLeastKnown = 1e-3;     ///< of the chosen session: so that one can come back
constexpr std::size_t kNeighbours = 32;  ///< looked at for those that face alike

}  // namespace

SessionChoice::SessionChoice(const TrainingMap& map, bool on)
    : map_(map), on_(on), matches_(map.header().sessions.size(), 1.0) {
  if (matches_.size() > 1) images_ = std::make_unique<const SessionIndex>(map);
}

SessionChoice::~SessionChoice() = default;

void SessionChoice::startImage(std::int64_t stamp_ns) {
  tried_.reset();
  ++images_seen_;
  if (!isOn() || std::exchange(started_, true)) return;
  std::int64_t least_ns = std::numeric_limits<std::int64_t>::max();
  std::int64_t latest_ns = std::numeric_limits<std::int64_t>::min();
  for (std::size_t i = 0; i < map_.size(); ++i) {
    const std::int64_t taken_ns = map_.pose(i).stamp_ns;
    const std::int64_t apart_ns = apartInDay_ns(taken_ns, stamp_ns);
    if (apart_ns > least_ns || (apart_ns == least_ns && taken_ns <= latest_ns)) continue;
    least_ns = apart_ns;
    latest_ns = taken_ns;
    chosen_ = sessionOf(i);
  }
}

std::optional<std::size_t> SessionChoice::chosen() const { return isOn() ? std::optional(chosen_) : std::nullopt; }

Neighbour SessionChoice::nearest(const Eigen::Vector2d& position_m) const {
  const Neighbour of_all = map_.nearest(position_m);
  if (!isOn() || !images_->has(chosen_)) return of_all;
  const Neighbour of_chosen = images_->nearest(chosen_, position_m);
  return of_chosen.distance_m <= of_all.distance_m + kReach_m ? of_chosen : of_all;
}

std::vector<std::size_t> SessionChoice::around(const Eigen::Vector2d& position_m, double yaw_rad,
                                               std::size_t count) const {
  return aroundOf(chosen(), position_m, yaw_rad, count);
}

std::vector<std::size_t> SessionChoice::aroundLike(std::size_t training_image, std::size_t count) const {
  return aroundOf(isOn() ? std::optional(sessionOf(training_image)) : std::nullopt, map_.position_m(training_image),
                  map_.yaw_rad(training_image), count);
}

std::vector<std::size_t> SessionChoice::aroundAny(const Eigen::Vector2d& position_m, double yaw_rad,
                                                  std::size_t count) const {
  return aroundOf(std::nullopt, position_m, yaw_rad, count);
}

std::vector<std::size_t> SessionChoice::aroundOf(std::optional<std::size_t> session, const Eigen::Vector2d& position_m,
                                                 double yaw_rad, std::size_t count) const {
  const auto facesAlike = [&](std::size_t image) { return faceAlike(map_.yaw_rad(image), yaw_rad); };
  std::vector<Neighbour> neighbours = map_.nearest(position_m, kNeighbours);
  neighbours.erase(std::remove_if(neighbours.begin(), neighbours.end(),
                                  [&](const Neighbour& neighbour) { return !facesAlike(neighbour.image); }),
                   neighbours.end());
  if (session && !neighbours.empty()) {
    std::vector<Neighbour> of_session;
    images_->nearest(*session, position_m, {count, kNeighbours}, facesAlike, of_session);
    if (!of_session.empty() && of_session.front().distance_m <= neighbours.front().distance_m + kReach_m) {
      neighbours = std::move(of_session);
    }
  }
  std::vector<std::size_t> images;
  for (std::size_t i = 0; i < std::min(count, neighbours.size()); ++i) images.push_back(neighbours[i].image);
  return images;
}

std::optional<std::size_t> SessionChoice::trial(const Eigen::Vector2d& position_m, double yaw_rad) {
  if (!isOn() || images_seen_ % kTrialEvery != 0) return std::nullopt;
  if (!tried_) tried_ = chosen_ != 0 && ++trials_ % 2 == 0 ? 0 : nextInTurn();
  std::vector<Neighbour> found;
  images_->nearest(
      *tried_, position_m, {1, kNeighbours, kReach_m},
      [&](std::size_t image) { return faceAlike(map_.yaw_rad(image), yaw_rad); }, found);
  return found.empty() ? std::nullopt : std::optional(found.front().image);
}

void SessionChoice::learn(std::size_t training_image, double match, std::size_t other_image, double other_match) {
  const std::size_t session = sessionOf(training_image);
  const std::size_t other = sessionOf(other_image);
  if (!isOn() || session == other) return;
  const double measured = (other_match + kLeastMatch) / (match + kLeastMatch);
  const double ratio = std::clamp(measured, 1.0 / kLargestRatio, kLargestRatio);
  matches_[other] = kMemory * matches_[other] + (1.0 - kMemory) * ratio * matches_[session];
  if (matches_[other] > kBetter * matches_[chosen_]) chosen_ = other;
  relateToChosen();
}

/// Each change of session multiplies what is known; only its ratio to the chosen one counts.
void SessionChoice::relateToChosen() {
  const double chosen = matches_[chosen_];
  for (double& match : matches_) match = std::max(match / chosen, kLeastKnown);
}

void SessionChoice::choose(std::size_t training_image) {
  if (!isOn()) return;
  chosen_ = sessionOf(training_image);
  matches_[chosen_] = *std::max_element(matches_.begin(), matches_.end());
  relateToChosen();
}

void SessionChoice::noteRecognition(bool recognised) {
  nothing_seen_ = recognised ? 0 : nothing_seen_ + 1;
  if (!isOn() || nothing_seen_ < kPatience) return;
  if (nothing_seen_ == kPatience) chosen_before_ = chosen_;
  chosen_ = nothing_seen_ % 2 == 0 ? bestOr(chosen_before_) : nextInTurn();
}

/// The session that matched best, or this one if none was better.
std::size_t SessionChoice::bestOr(std::size_t session) const {
  const auto best = std::max_element(matches_.begin(), matches_.end());
  return matches_[session] >= *best ? session : static_cast<std::size_t>(best - matches_.begin());
}

/// Another session than the chosen one.
std::size_t SessionChoice::nextInTurn() {
  do {
    turn_ = (turn_ + 1) % matches_.size();
  } while (turn_ == chosen_);
  return turn_;
}

std::size_t SessionChoice::sessionOf(std::size_t training_image) const {
  return static_cast<std::size_t>(map_.pose(training_image).session);
}

}  // namespace visual_localization

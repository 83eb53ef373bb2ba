#include "node/recording_watch.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/time.h"
#include "survey/map_survey.h"

namespace visual_localization {
namespace {

constexpr std::size_t kImagesOfSpacing = 10;  ///< noise of fixes, or their low rate, must not look like speed
constexpr double kSameLine_m = 2.0;
constexpr double kMaxFixAge_s = 2.0;     ///< slow receivers give a fix a second, and one may be lost
constexpr std::size_t kNeighbours = 32;  ///< one of each session should be among them

}  // namespace

void WatchConfig::declare(ParameterVisitor& visitor) {
  visitor.real({"max_spacing", "m", "images farther apart than this are called weak"}, max_spacing_m, 0.1, 100.0);
  visitor.real({"max_fix_sigma", "m", "a fix whose receiver claims a larger standard deviation is called poor"},
               max_fix_sigma_m, 0.01, 1000.0);
}

const char* describe(Weakness weakness) {
  switch (weakness) {
    case Weakness::kNone:
      return "good";
    case Weakness::kNoFix:
      return "no usable fix";
    case Weakness::kPoorFix:
      return "poor fixes";
    case Weakness::kFewFeatures:
      return "few features";
    case Weakness::kFarApart:
      return "images too far apart";
  }
  return "";
}

RecordingWatch::RecordingWatch(const WatchConfig& config, std::shared_ptr<const TrainingMap> map)
    : config_(config), map_(std::move(map)) {
  if (map_) frame_.emplace(map_->frame());
}

void RecordingWatch::addFix(const Fix& fix) {
  ++summary_.fixes;
  if (!hasPosition(fix)) return;
  if (!frame_) frame_.emplace(GeodeticPoint{fix.position.latitude_deg, fix.position.longitude_deg, 0.0});
  ++summary_.usable_fixes;
  summary_.fix_sigma_m = fix.sigma_m;
  last_fix_ = fix;
  position_m_ = frame_->toEastNorth(fix.position);
}

bool RecordingWatch::hasPositionAt(std::int64_t stamp_ns) const {
  return last_fix_ && std::abs(secondsBetween(last_fix_->stamp_ns, stamp_ns)) <= kMaxFixAge_s;
}

void RecordingWatch::addImage(std::int64_t stamp_ns) {
  if (!hasPositionAt(stamp_ns)) {
    last_images_.clear();
    return;
  }
  last_images_.push_back(position_m_);
  if (last_images_.size() > kImagesOfSpacing) last_images_.pop_front();
  const auto steps = static_cast<double>(last_images_.size() - 1);
  summary_.spacing_m = steps > 0.0 ? (last_images_.back() - last_images_.front()).norm() / steps : 0.0;
  addWay();
}

void RecordingWatch::addLook(std::int64_t stamp_ns, std::size_t features) {
  const Weakness weakness = weaknessOf(stamp_ns, features);
  if (last_fix_) spots_.push_back({position_m_, weakness});
  if (hasPositionAt(stamp_ns)) {
    ++placed_;
    known_ += isKnown(stamp_ns) ? 1 : 0;
    summary_.known_way_share = static_cast<double>(known_) / static_cast<double>(placed_);
  }
  ++summary_.images;
  ++summary_.weak[static_cast<std::size_t>(weakness)];
  summary_.now = weakness;
  summary_.features = features;
}

/// In steps that the noise of fixes does not lengthen much.
void RecordingWatch::addWay() {
  constexpr double kStep_m = 3.0;
  if (!way_from_m_) way_from_m_ = position_m_;
  const double step_m = (position_m_ - *way_from_m_).norm();
  if (step_m < kStep_m) return;
  summary_.way_m += step_m;
  way_from_m_ = position_m_;
}

Weakness RecordingWatch::weaknessOf(std::int64_t stamp_ns, std::size_t features) const {
  if (!hasPositionAt(stamp_ns)) return Weakness::kNoFix;
  if (last_fix_->sigma_m > config_.max_fix_sigma_m) return Weakness::kPoorFix;
  if (features < SurveyConfig().few_features) return Weakness::kFewFeatures;
  return summary_.spacing_m > config_.max_spacing_m ? Weakness::kFarApart : Weakness::kNone;
}

bool RecordingWatch::isKnown(std::int64_t stamp_ns) const {
  if (!map_) return false;
  const std::vector<Neighbour> neighbours = map_->nearest(position_m_, kNeighbours);
  return std::any_of(neighbours.begin(), neighbours.end(), [&](const Neighbour& neighbour) {
    constexpr std::int64_t kSameLight_ns = 2 * 3'600'000'000'000;
    return neighbour.distance_m <= kSameLine_m &&
           apartInDay_ns(map_->pose(neighbour.image).stamp_ns, stamp_ns) <= kSameLight_ns;
  });
}

}  // namespace visual_localization

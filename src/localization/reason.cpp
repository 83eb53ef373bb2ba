#include "visual_localization/localization/reason.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "visual_localization/localization/estimate.h"
#include "visual_localization/localization/state.h"

namespace visual_localization {
namespace {

// In the order of the numbers. doc/when_it_does_not_localise.md has the same words.
constexpr std::array<ReasonText, kReasons> kTexts{{
    {"NOT_SURE_YET", "Not sure yet: the images so far do not decide between the places of the map", "probability",
     "drive on; or tell it where it is (initialpose, relocalize)"},
    {"LANDMARKS", "Landmarks confirm the pose", "inliers", "-"},
    {"ALONG_THE_WAY", "The images along the way confirm the place", "probability", "-"},
    {"SIMILAR_IMAGES", "The last images look like those of this place", "similarity", "-"},
    {"PLACES_ALIKE", "Another place of the map looks as much like the images", "probability there",
     "drive on until the places differ; add another session there (map_info --ambiguity lists such places)"},
    {"WEAK_MATCHES", "The image has features enough, but few match the map: other light, or the scene has changed",
     "matches", "record a session in this light and add it to the map (map_edit add)"},
    {"FEW_FEATURES", "The image shows hardly anything: dark, blurred or covered", "features",
     "look at the picture: exposure, speed, lens cap, dirt"},
    {"MAP_ENDS", "The robot is beyond an end of the map", "probability off the map",
     "turn back, or record from this end on and add it to the map (map_edit add)"},
    {"NOT_MAPPED", "Nothing in the map looks like the image: not mapped here, or in quite another light",
     "probability off the map", "drive back to the map, or map this way; check that it is the right map"},
    {"OTHER_DIRECTION", "The robot looks where no image of the map does", "",
     "drive in the direction of the map, or record a session in this one"},
    {"OTHER_LENS", "The images were taken through another lens than the map's", "focal length, share of calibration",
     "use the camera and the zoom of the map, or calibrate the live camera again"},
    {"OTHER_SHAPE", "The images have another shape than the map's", "width to height, share of the map's",
     "use the camera mode that recorded the map"},
    {"NO_LANDMARKS", "The place looks right, but landmarks do not confirm the pose", "probability",
     "drive on; where it stays so, add another session there; check the calibration"},
    {"UNSTEADY", "The last positions do not follow a steady motion", "m off it",
     "more images per second; raise state/max_motion_residual for a robot that turns on the spot"},
    {"IMAGE_LATE", "The image is older than the one before it", "", "mend the stamps; one camera on one topic"},
    {"IMAGES_DROPPED", "Images come faster than this machine takes them", "images dropped before this one",
     "fewer images per second, or a faster machine (extract_ms and match_ms say what takes the time)"},
    {"IMAGE_REPEATED", "The camera sends the same image again and again", "repeats",
     "restart the camera driver, check the cable"},
    {"CAMERA_SILENT", "No image comes from the camera", "s", "check the camera and the topic that the log names"},
    {"CLOCKS_DIFFER", "The stamps of the images lie in the future: the clocks differ", "s ahead",
     "set the clocks of the machines by one another (chrony, NTP)"},
    {"NO_MAP", "No map is loaded", "", "load one: map:=/absolute/path, or the service load_map"},
    {"VAGUE", "The place is known, but its position too badly to act on", "m, one sigma",
     "look at the expected error of the map (map_info); record this stretch again"},
}};

constexpr double kLikely = 0.5;

/// Integers as such, others with two digits behind the point.
std::string shown(double value) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), value == std::floor(value) ? "%.0f" : "%.2f", value);
  return text.data();
}

bool matchesWeakly(const Score& best, FeatureKind features, const StateConfig& config) {
  if (features == FeatureKind::kGlobal) return best.similarity < config.min_global_similarity;
  return best.similarity < config.min_similarity || best.matches < static_cast<std::size_t>(config.min_matches);
}

Why byProbability(const Estimate& estimate, const Circumstances& circumstances) {
  constexpr std::size_t kFirst = 3;  // images, of which nothing is known
  const PlaceBelief& belief = estimate.belief;
  const Score& best = estimate.tracked.best;
  const double probability = *estimate.evidence.probability;
  const bool first = estimate.state == LocalizationState::kInitializing && circumstances.unconfirmed < kFirst;
  if (!first && belief.off_map >= kLikely) {
    if (circumstances.left_at) return {StateReason::kMapEnds, belief.off_map, circumstances.left_at->position_m};
    const bool follows = belief.followed >= kLikely;
    return follows ? Why{StateReason::kWeakMatches, static_cast<double>(best.matches)}
                   : Why{StateReason::kNotMapped, belief.off_map};
  }
  if (estimate.evidence.vague) return {StateReason::kVague, largerSigma(estimate.pose.covariance_m2)};
  if (belief.rival && belief.rival->probability >= kLikely * (1.0 - probability)) {
    return {StateReason::kPlacesAlike, belief.rival->probability, belief.rival->position_m};
  }
  if (estimate.evidence.unverified) return {StateReason::kNoLandmarks, probability};
  if (!first && !best.recognised) return {StateReason::kWeakMatches, static_cast<double>(best.matches)};
  return {StateReason::kNotSureYet, probability};
}

Why byThresholds(const Estimate& estimate, const StateConfig& config, const Circumstances& circumstances) {
  const Score& best = estimate.tracked.best;
  if (circumstances.doubtful) return {StateReason::kPlacesAlike};
  if (matchesWeakly(best, estimate.evidence.features, config)) {
    return {StateReason::kWeakMatches, static_cast<double>(best.matches)};
  }
  if (estimate.motion_residual_m > config.max_motion_residual_m) {
    return {StateReason::kUnsteady, estimate.motion_residual_m};
  }
  return {StateReason::kNotSureYet};
}

}  // namespace

const ReasonText& textOf(StateReason reason) { return kTexts.at(static_cast<std::size_t>(reason)); }

std::string describe(const Why& why) {
  const ReasonText& text = textOf(why.reason);
  std::string words = text.sentence;
  if (why.position_m.allFinite()) {
    words += ", at x = " + shown(why.position_m.x()) + " m, y = " + shown(why.position_m.y()) + " m";
  }
  if (*text.figure != '\0' && std::isfinite(why.figure)) {
    words += " (" + std::string(text.figure) + ": " + shown(why.figure) + ")";
  }
  return words;
}

Why explain(const Estimate& estimate, const StateConfig& config, const Circumstances& circumstances) {
  constexpr double kStretched = 0.05;
  const Evidence& evidence = estimate.evidence;
  if (estimate.state == LocalizationState::kTracking) {
    if (evidence.verified.value_or(false)) {
      return {StateReason::kLandmarks, static_cast<double>(estimate.metric->inliers)};
    }
    return evidence.probability ? Why{StateReason::kAlongTheWay, *evidence.probability}
                                : Why{StateReason::kSimilarImages, estimate.tracked.best.similarity};
  }
  if (circumstances.late) return {StateReason::kImageLate};
  if (evidence.blind) return {StateReason::kFewFeatures, static_cast<double>(estimate.image.features_kept)};
  const double stretch = estimate.image.statistics.stretch;
  if (std::abs(stretch - 1.0) > kStretched) return {StateReason::kOtherShape, stretch};
  if (estimate.other_lens) return {StateReason::kOtherLens, estimate.focal_scale};
  if (circumstances.turned) return {StateReason::kOtherDirection};
  return evidence.probability ? byProbability(estimate, circumstances) : byThresholds(estimate, config, circumstances);
}

}  // namespace visual_localization

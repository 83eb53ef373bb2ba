#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "geometry/bundle_problem.h"
#include "geometry/feature_tracks.h"

namespace visual_localization {

/// Landmarks by what shows them.
class SeenLandmarks {
 public:
  /// Points into `landmarks`, which may move.
  explicit SeenLandmarks(const std::vector<Landmark>& landmarks) {
    for (const Landmark& landmark : landmarks) {
      for (const LandmarkObservation& observation : landmark.observations) {
        landmarks_[key({observation.image, observation.feature})] = &landmark;
      }
    }
  }

  /// Null when it shows none.
  const Landmark* at(const FeatureObservation& seen) const {
    const auto found = landmarks_.find(key(seen));
    return found == landmarks_.end() ? nullptr : found->second;
  }

 private:
  static std::uint64_t key(const FeatureObservation& seen) {
    return (static_cast<std::uint64_t>(seen.image) << 32U) | seen.feature;
  }

  std::unordered_map<std::uint64_t, const Landmark*> landmarks_;
};

}  // namespace visual_localization

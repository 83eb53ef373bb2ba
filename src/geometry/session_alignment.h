#pragma once

#include <vector>

#include "geometry/feature_tracks.h"
#include "geometry/reconstruction.h"

namespace visual_localization {

/// Moves each session of `reconstruction` to where those before it have what both see: its landmarks beside theirs, by
/// the matches in `ties`. The shift follows the path, since fixes err another way from one stretch to the next. Returns
/// how far each session was from the ones before, metres: the median over its ties; 0 without any.
std::vector<double> alignSessions(const std::vector<ImagePair>& ties, Reconstruction& reconstruction);

}  // namespace visual_localization

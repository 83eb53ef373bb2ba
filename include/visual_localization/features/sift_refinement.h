#pragma once

#include <optional>

#include "visual_localization/features/sift_extractor.h"
#include "visual_localization/features/sift_extrema.h"
#include "visual_localization/features/sift_point.h"
#include "visual_localization/features/sift_scale_space.h"

namespace visual_localization {

/// Fits a parabola to the differences around an extremum and moves it to the parabola's vertex (Lowe 2004, section 4,
/// Eq. 2 and 3). Nothing when it wanders out of the octave, has little contrast, or lies on an edge (section 4.1).
/// `octave_index` is only noted in the result, whose angle is not set.
std::optional<SiftPoint> refine(const SiftOctave& octave, int octave_index, const SiftExtremum& extremum,
                                const SiftConfig& config);

}  // namespace visual_localization

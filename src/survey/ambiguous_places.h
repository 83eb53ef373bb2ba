#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "survey/map_survey.h"
#include "visual_localization/base/progress.h"
#include "visual_localization/features/sift_matcher.h"
#include "visual_localization/localization/score.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization {

/// When two images look alike although they are far apart, and how much work may go into finding them.
struct AmbiguityConfig {
  double near_m = 5.0;                       ///< an image not farther away shows the same scene
  double far_m = 20.0;                       ///< one farther away shows another scene
  double nearly_as_good = 0.7;               ///< similarity of the far one, as a share of the best near one's
  double least_similarity = 0.08;            ///< of the far one by SIFT; a weaker one would confirm no position
  double global_nearly_as_good = 0.985;      ///< the share for global features
  std::size_t most_images = 2000;            ///< of a larger map every k-th image is asked about, and compared with
  std::size_t shortlist = 5;                 ///< far images, the most alike globally, that are compared by SIFT
  std::uint64_t most_work = 10'000'000'000;  ///< pairs of SIFT descriptors
  MatchConfig match;
  SimilarityConfig similarity;
};

/// An image that looks nearly as much like one far away as like its neighbours.
struct AmbiguousImage {
  std::size_t image = 0;
  std::size_t twin = 0;        ///< the image far away
  double similarity = 0.0;     ///< to the twin, by SIFT
  double near_similarity = 0;  ///< to the best near image, by SIFT
};

struct AmbiguousPlaces {
  std::vector<AmbiguousImage> images;  ///< in order of the map
  std::vector<Stretch> stretches;      ///< successive ones among those asked about
  std::size_t asked = 0;               ///< images that were compared
  std::size_t unasked = 0;             ///< images for which no work was left
  std::size_t unjudged = 0;     ///< images without a near one that faces alike: nothing to hold the far ones against
  std::size_t stride = 1;       ///< every so many-th image was asked about
  std::size_t global_only = 0;  ///< images that are ambiguous when only global features are compared
};

/// Looks for images whose best match far away is nearly as good as the best of their neighbours that face alike, of
/// whichever session: a twin of another session at the same place is no rival. Global features make a shortlist of far
/// images, SIFT decides.
AmbiguousPlaces findAmbiguousPlaces(const TrainingMap& map, const AmbiguityConfig& config = {},
                                    const Progress& progress = {});

}  // namespace visual_localization

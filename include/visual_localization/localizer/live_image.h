#pragma once

#include "visual_localization/localizer/front_end.h"
#include "visual_localization/map/training_map.h"
#include "visual_localization/similarity/comparable_image.h"
#include "visual_localization/similarity/global_similarity.h"
#include "visual_localization/similarity/sift_similarity.h"

namespace visual_localization {

/// The image that a front end holds, compared with a map. All parts must outlive it.
class LiveImage final : public ComparableImage {
 public:
  LiveImage(FrontEnd& front_end, const TrainingMap& map, const SiftSimilarity& sift, const GlobalSimilarity& global)
      : front_end_(front_end), map_(map), sift_(sift), global_(global) {}

  Score compare(FeatureKind kind, std::size_t training_image) override;
  std::size_t siftFeatures() override { return front_end_.sift().size(); }
  /// Time spent on comparisons, without the extraction that they brought about.
  double match_ms() const { return match_ms_; }

 private:
  FrontEnd& front_end_;
  const TrainingMap& map_;
  const SiftSimilarity& sift_;
  const GlobalSimilarity& global_;
  double match_ms_ = 0.0;
};

}  // namespace visual_localization

#pragma once

#include "visual_localization/features/global_features.h"
#include "visual_localization/similarity/score.h"
#include "visual_localization/similarity/similarity_config.h"

namespace visual_localization {

/// Product of the normalised intersections of the WGOH and of the WGII histograms (Weiss et al., section II.C).
/// Stateless, so that one may serve several threads.
class GlobalSimilarity {
 public:
  explicit GlobalSimilarity(const SimilarityConfig& config) : config_(config) {}
  Score compare(const GlobalFeatures& current, const GlobalFeatures& training) const;
  /// What a similarity that is known already means.
  Score scoreOf(double similarity) const;

 private:
  SimilarityConfig config_;
};

}  // namespace visual_localization

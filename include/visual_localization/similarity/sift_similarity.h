#pragma once

#include <cstddef>

#include "visual_localization/features/sift_features.h"
#include "visual_localization/features/sift_matcher.h"
#include "visual_localization/similarity/score.h"
#include "visual_localization/similarity/similarity_config.h"

namespace visual_localization {

/// Share of SIFT features that match (Kronfeld et al. (journal), section 4; one-way: Weiss et al., section III).
/// Stateless, so that one may serve several threads.
class SiftSimilarity {
 public:
  SiftSimilarity(const MatchConfig& match, const SimilarityConfig& config);
  /// 0 when either image has fewer than two features.
  Score compare(const SiftFeatures& current, const SiftFeatures& training) const;
  /// What a similarity that is known already means.
  Score scoreOf(double similarity, std::size_t matches, double scale) const;

 private:
  double max_angle_ratio_;
  bool symmetric_;
  double recognised_;
};

}  // namespace visual_localization

#pragma once

#include <cstddef>

#include "visual_localization/features/image_features.h"
#include "visual_localization/features/sift_matcher.h"
#include "visual_localization/map/training_image.h"

namespace visual_localization {

/// How alike two images are, and on how much evidence.
struct Score {
  double similarity = 0.0;  ///< m in [0, 1]
  std::size_t matches = 0;  ///< matched local features behind it; 0 for global features
};

/// m(A, B) of Kronfeld et al. (journal), Eq. 3: any measure of how alike two images are. Stateless, so that
/// one may serve several threads.
class Similarity {
 public:
  virtual ~Similarity() = default;
  virtual Score compare(const ImageFeatures& current, const TrainingImage& training) const = 0;
};

/// Share of SIFT features that match (Kronfeld et al. (journal), section 4; one-way: Weiss et al., section III).
/// 0 when either image has fewer than two features.
class SiftSimilarity : public Similarity {
 public:
  explicit SiftSimilarity(const MatchConfig& config) : config_(config) {}
  Score compare(const ImageFeatures& current, const TrainingImage& training) const override;

 private:
  MatchConfig config_;
};

}  // namespace visual_localization

#include "visual_localization/similarity/global_similarity.h"

#include <cmath>

#include "visual_localization/features/histogram_intersection.h"

namespace visual_localization {

Score GlobalSimilarity::compare(const GlobalFeatures& current, const GlobalFeatures& training) const {
  return scoreOf(histogramIntersection(current.wgoh, training.wgoh) *
                 histogramIntersection(current.wgii, training.wgii));
}

Score GlobalSimilarity::scoreOf(double similarity) const {
  return {similarity, std::pow(similarity, config_.global_exponent), 0, similarity >= config_.global_recognised};
}

}  // namespace visual_localization

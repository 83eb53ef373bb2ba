#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "visual_localization/features/sift_features.h"
#include "visual_localization/parameters/parameter_visitor.h"

namespace visual_localization {

/// When two descriptors count as the same thing in the world.
struct MatchConfig {
  double max_angle_ratio = 0.6;    ///< delta of Kronfeld et al. (journal), section 4
  std::string mode = "symmetric";  ///< "symmetric" (journal) or "one_way" (conference, hybrid)

  void declare(ParameterVisitor& visitor);
  std::vector<std::string> violations() const { return {}; }
};

/// Feature `a` of the first image matches feature `b` of the second.
struct FeatureMatch {
  std::size_t a = 0;
  std::size_t b = 0;
};

/// M_AB of Kronfeld et al. (journal), section 4: for each a its nearest neighbour b in B when
/// acos(<a,b1>) / acos(<a,b2>) < max_angle_ratio on unit descriptors. Empty when either side has fewer than two
/// features. In order of a.
std::vector<FeatureMatch> matchOneWay(const SiftFeatures& a, const SiftFeatures& b, double max_angle_ratio);

/// M*_AB: pairs that are each other's nearest neighbour and pass the ratio test in both directions. In order of a.
std::vector<FeatureMatch> matchSymmetric(const SiftFeatures& a, const SiftFeatures& b, double max_angle_ratio);

/// Into `matched`: the features of `a` that matchOneWay matches, in order; without memory of its own.
void matchOneWay(const SiftFeatures& a, const SiftFeatures& b, double max_angle_ratio,
                 std::vector<std::size_t>& matched);
/// How many matches there are.
std::size_t countOneWay(const SiftFeatures& a, const SiftFeatures& b, double max_angle_ratio);
std::size_t countSymmetric(const SiftFeatures& a, const SiftFeatures& b, double max_angle_ratio);

}  // namespace visual_localization

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
/// The same as above into `matches`; without memory of their own.
void matchOneWay(const SiftFeatures& a, const SiftFeatures& b, double max_angle_ratio,
                 std::vector<FeatureMatch>& matches);
void matchSymmetric(const SiftFeatures& a, const SiftFeatures& b, double max_angle_ratio,
                    std::vector<FeatureMatch>& matches);

/// Median size of the matched features of `a` as a share of their partners' in `b`: how much larger the same things
/// look, and so how much nearer they are, seen from a. 1 without matches of
/// sizes above 0.
double medianScale(const SiftFeatures& a, const SiftFeatures& b, const std::vector<FeatureMatch>& matches);

}  // namespace visual_localization

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "visual_localization/features/local_features.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// When two descriptors count as the same thing in the world.
struct MatchConfig {
  double max_angle_ratio = 0.6;
  std::string mode = "symmetric";  ///< as in the papers

  void declare(ParameterVisitor& visitor);
  /// Of which image's features a similarity is the share: of those of the first one, or of the smaller set.
  bool isOneWay() const { return mode == "one_way"; }
  bool isByVotes() const { return mode == "votes"; }
};

/// Feature `a` of the first image matches feature `b` of the second.
struct FeatureMatch {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
};

/// M_AB of Kronfeld et al. (journal), section 4: for each a its nearest neighbour b in B when
/// acos(<a,b1>) / acos(<a,b2>) < max_angle_ratio on unit descriptors. Empty when either side has fewer than two
/// features. In order of a.
std::vector<FeatureMatch> matchOneWay(const LocalFeatures& a, const LocalFeatures& b, double max_angle_ratio);

/// M*_AB: pairs that are each other's nearest neighbour and pass the ratio test in both directions. In order of a.
std::vector<FeatureMatch> matchSymmetric(const LocalFeatures& a, const LocalFeatures& b, double max_angle_ratio);

/// The same as above into `matches`; without memory of their own.
void matchOneWay(const LocalFeatures& a, const LocalFeatures& b, double max_angle_ratio,
                 std::vector<FeatureMatch>& matches);
void matchSymmetric(const LocalFeatures& a, const LocalFeatures& b, double max_angle_ratio,
                    std::vector<FeatureMatch>& matches);
/// Pairs that are each other's nearest neighbour among those at most `max_dy_px` above or below, however near the
/// second nearest is.
void matchMutual(const LocalFeatures& a, const LocalFeatures& b, double max_dy_px, std::vector<FeatureMatch>& matches);
/// By the mode and the ratio of `config`. By votes: of matchMutual(), the largest number with a common displacement
/// (see displacement_votes.h), for images of this width. `vote_rows`: see LocalFeatureKind.
void matchBy(const MatchConfig& config, const LocalFeatures& a, const LocalFeatures& b, double image_width_px,
             double vote_rows, std::vector<FeatureMatch>& matches);

/// Median size of the matched features of `a` as a share of their partners' in `b`: how much larger the same things
/// look, and so how much nearer they are, seen from a. 1 without matches of sizes above 0.
double medianScale(const LocalFeatures& a, const LocalFeatures& b, const std::vector<FeatureMatch>& matches);

/// Without the "noisy" features that appear in one image only (Weiss et al., section III): the indices of those of
/// `features`, in order, that match (one way, ratio test) a feature of at least one of `neighbours`. The neighbours are
/// given unpruned.
std::vector<std::size_t> seenIn(const LocalFeatures& features, const std::vector<const LocalFeatures*>& neighbours,
                                double max_angle_ratio);

/// The features themselves.
LocalFeatures keepSeenIn(const LocalFeatures& features, const std::vector<const LocalFeatures*>& neighbours,
                         double max_angle_ratio);

/// The same with one neighbour, into `kept`, whose memory is used again.
void keepSeenIn(const LocalFeatures& features, const LocalFeatures& neighbour, double max_angle_ratio,
                LocalFeatures& kept);

}  // namespace visual_localization

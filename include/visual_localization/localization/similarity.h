#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "visual_localization/features/feature_matcher.h"
#include "visual_localization/features/global_features.h"
#include "visual_localization/features/local_feature_kind.h"
#include "visual_localization/features/local_features.h"
#include "visual_localization/features/sift.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// Which features images are compared by. VLAD only proposes: see MapSweep::mostSimilar.
enum class FeatureKind : std::uint8_t { kLocal = 0, kGlobal = 1, kVlad = 2 };

/// How alike two images are, and on how much evidence.
struct Score {
  double similarity = 0.0;  ///< m in [0, 1]
  double weight = 0.0;      ///< what counts for a particle, [0, 1]: m, sharpened for votes and global features
  std::size_t matches = 0;  ///< matched local features behind it; 0 for global features
  bool recognised = false;  ///< m is good enough to be no accident
  double scale = 1.0;       ///< median size of the matched features, share of their size in training; 1 without any
};

/// What a similarity means, for each kind of features.
struct SimilarityConfig {
  double sift_recognised = 0.05;
  double votes_recognised = 0.016;  ///< no parameter, nor is what follows
  double votes_exponent = 2.0;      ///< a share of votes is raised to this to become a weight
  double global_recognised = 0.6;
  double global_exponent = 20.0;  ///< the same of a global similarity (Weiss et al., section IV.A)

  /// The least similarity that is no accident.
  double recognised(FeatureKind features, const MatchConfig& match) const {
    if (features == FeatureKind::kGlobal) return global_recognised;
    return match.isByVotes() ? votes_recognised : sift_recognised;
  }
  /// What a similarity is raised to, to become a weight.
  double exponent(FeatureKind features, const MatchConfig& match) const {
    if (features == FeatureKind::kGlobal) return global_exponent;
    return match.isByVotes() ? votes_exponent : 1.0;
  }
  void declare(ParameterVisitor& visitor);
};

/// Share of local features that match (Kronfeld et al. (journal), section 4; one-way: Weiss et al., section III).
/// Stateless, so that one may serve several threads.
class LocalSimilarity {
 public:
  /// `image_width_px`: the map's, like `kind`.
  LocalSimilarity(const MatchConfig& match, const SimilarityConfig& config, int image_width_px = 640,
                  std::shared_ptr<const LocalFeatureKind> kind = std::make_shared<Sift>());
  /// 0 when either image has fewer than two features.
  Score compare(const LocalFeatures& current, const LocalFeatures& training) const;
  /// The score of a similarity that is known already.
  Score scoreOf(double similarity, std::size_t matches, double scale) const;

 private:
  std::shared_ptr<const LocalFeatureKind> kind_;
  MatchConfig match_;
  double recognised_;
  double exponent_;
  double image_width_px_;
};

/// Product of the normalised intersections of the WGOH and of the WGII histograms (Weiss et al., section II.C).
/// Stateless, so that one may serve several threads.
class GlobalSimilarity {
 public:
  explicit GlobalSimilarity(const SimilarityConfig& config) : config_(config) {}
  Score compare(const GlobalFeatures& current, const GlobalFeatures& training) const;
  /// The score of a similarity that is known already.
  Score scoreOf(double similarity) const;

 private:
  SimilarityConfig config_;
};

}  // namespace visual_localization

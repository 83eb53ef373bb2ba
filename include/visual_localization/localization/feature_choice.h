#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/localization/score.h"
#include "visual_localization/parameters/parameter_visitor.h"

namespace visual_localization {

/// Thresholds of the hybrid choice (Weiss et al., section IV.B).
struct HybridConfig {
  double sift_below_m = 7.0;    ///< d_SIFT: after SIFT, global features are next when both sigmas are below
  double global_above_m = 5.5;  ///< d_global: after global features, SIFT is next when one sigma is above
  bool sift_in_doubt = true;    ///< SIFT also as long as the image looks more like another place
  int sift_every = 10;          ///< SIFT at least so often, and then until an image confirms the position; 0: never

  void declare(ParameterVisitor& visitor);
};

/// Which features the next image is compared by: always the same ones, or by how far the cloud is spread (Weiss et
/// al., section IV.B). Works on any tracker's cloud. Of the swarm all particles count, by their fitness: the quantum
/// particles are its feelers, and a rival place that one of them finds widens the cloud. (Measured against the others
/// alone, sunny to cloudy: 2.40 m at 5.4 % SIFT against 2.46 m at 4.2 %; the same trade.)
class FeatureChoice {
 public:
  /// `features`: "sift", "global" or "hybrid".
  FeatureChoice(const std::string& features, const HybridConfig& config);

  /// Other features or thresholds. The next image is compared as it would have been, unless the features are others.
  void configure(const std::string& features, const HybridConfig& config);
  /// The position is unknown: the hybrid choice begins with SIFT.
  void reset();
  FeatureKind next() const { return next_; }
  /// After an image that was compared by next(): `spread_m` is sigma_x, sigma_y of the cloud (Eq. 2). `confirmed`: the
  /// image confirms the position. `doubtful`: the last images look more like another place than like this one, which a
  /// small cloud at the wrong place cannot see.
  void update(const Eigen::Vector2d& spread_m, bool confirmed, bool doubtful);

 private:
  bool isSiftDue(bool confirmed) const;

  bool hybrid_;
  HybridConfig config_;
  FeatureKind first_;
  FeatureKind next_;
  int since_sift_ = 0;  ///< images since the last one that was compared by SIFT
};

}  // namespace visual_localization

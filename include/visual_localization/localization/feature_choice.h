#pragma once

#include <string>

#include <Eigen/Core>

#include "visual_localization/localization/similarity.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// Thresholds of the hybrid choice (Weiss et al., section IV.B).
struct HybridConfig {
  double sift_below_m = 7.0;
  double global_above_m = 5.5;
  int sift_every = 10;

  void declare(ParameterVisitor& visitor);
};

/// Which features the next image is compared by: always the same ones, or by how far the cloud is spread (Weiss et
/// al., section IV.B). Works on any tracker's cloud. Of the swarm all particles count, by their fitness: a rival
/// position that a quantum particle finds widens the cloud.
class FeatureChoice {
 public:
  /// `features`: "global", "hybrid", or the name of a kind of local features.
  FeatureChoice(const std::string& features, const HybridConfig& config);

  /// Other features or thresholds. The next image is compared as it would have been, unless the features are others.
  void configure(const std::string& features, const HybridConfig& config);
  /// The position is unknown: the hybrid choice begins with local features.
  void reset();
  FeatureKind next() const { return next_; }
  /// After an image that was compared by next(): `spread_m` is sigma_x, sigma_y of the cloud (Eq. 2). `confirmed`: the
  /// image confirms the position. `doubtful`: the last images look more like another place than like this one, which a
  /// small cloud at the wrong place cannot see.
  void update(const Eigen::Vector2d& spread_m, bool confirmed, bool doubtful);

 private:
  bool isLocalDue(bool confirmed) const;

  bool hybrid_;
  HybridConfig config_;
  FeatureKind first_;
  FeatureKind next_;
  int since_local_ = 0;  ///< images since the last one that was compared by local features
};

}  // namespace visual_localization

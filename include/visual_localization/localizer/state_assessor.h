#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/localizer/estimate.h"
#include "visual_localization/parameters/parameter_visitor.h"

namespace visual_localization {

/// When a position counts as confirmed.
struct StateConfig {
  double min_similarity = 0.08;         ///< a weaker best SIFT match does not confirm a position
  int min_matches = 5;                  ///< fewer matched SIFT features are no evidence, whatever their share
  double min_global_similarity = 0.65;  ///< a weaker best match by global features does not confirm a position
  double max_distance_m = 5.0;          ///< a best match farther from the estimate does not confirm it
  int window = 5;                       ///< so many of the last images are looked at
  int images_to_confirm = 4;            ///< so many of them must confirm the position
  double max_step_m = 10.0;             ///< a larger jump between two images makes what came before worthless

  void declare(ParameterVisitor& visitor);
  std::vector<std::string> violations() const;
};

/// Turns the evidence of successive images into a state. The cloud alone cannot tell whether a robot is lost;
/// the image match is independent evidence.
class StateAssessor {
 public:
  explicit StateAssessor(const StateConfig& config) : config_(config) {}
  /// The position is unknown again.
  void reset();
  /// The state after one more image.
  LocalizationState assess(const TrackerEstimate& estimate, FeatureKind features, bool recovering);

 private:
  bool confirms(const TrackerEstimate& estimate, FeatureKind features) const;

  StateConfig config_;
  std::deque<bool> confirmations_;  ///< of the last images, newest at the back
  bool ever_confirmed_ = false;     ///< since the last reset
  std::optional<Eigen::Vector2d> last_position_m_;
};

}  // namespace visual_localization

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "visual_localization/localizer/estimate.h"
#include "visual_localization/parameters/parameter_visitor.h"

namespace visual_localization {

/// When a position counts as confirmed.
struct StateConfig {
  int min_matches = 4;            ///< fewer matched features are no evidence, whatever their share
  int images_to_confirm = 3;      ///< recognised images in a row before TRACKING
  int images_to_doubt = 2;        ///< unrecognised images in a row before UNCERTAIN
  double max_step_m = 10.0;       ///< a larger jump between two images breaks the row

  void declare(ParameterVisitor& visitor);
  std::vector<std::string> violations() const { return {}; }
};

/// Turns the evidence of successive images into a state. The cloud alone cannot tell whether a robot is lost;
/// the image match is independent evidence.
class StateAssessor {
 public:
  StateAssessor(const StateConfig& config, double recognised_similarity);
  /// The position is unknown again.
  void reset();
  /// The state after one more image.
  LocalizationState assess(const TrackerEstimate& estimate, bool recovering);

 private:
  StateConfig config_;
  double recognised_similarity_;
  int recognised_ = 0;    ///< in a row
  int unrecognised_ = 0;  ///< in a row
  bool confirmed_ = false;
  bool has_last_ = false;
  Eigen::Vector2d last_position_m_ = Eigen::Vector2d::Zero();
};

}  // namespace visual_localization

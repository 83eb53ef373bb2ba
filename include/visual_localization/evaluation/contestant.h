#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "visual_localization/evaluation/experiment.h"
#include "visual_localization/evaluation/score_table.h"
#include "visual_localization/localizer/estimate.h"

namespace visual_localization {

/// What a method under test says after one image.
struct Verdict {
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< in the map frame
  double confidence = 0.0;                               ///< the larger the surer
  FeatureKind features = FeatureKind::kSift;
  std::size_t comparisons = 0;       ///< training images compared
  std::optional<Estimate> estimate;  ///< of a tracker, for tracing
};

/// A method under test in one run.
class Contestant {
 public:
  virtual ~Contestant() = default;
  virtual Verdict process(std::int64_t stamp_ns, RecordedImage& image) = 0;
  /// Mean distance between two particles, metres; 0 for a method without particles. Not cheap.
  virtual double diversity_m() const { return 0.0; }
};

/// `seed` makes the runs of one method differ. `closed`: the map is a closed round.
std::unique_ptr<Contestant> makeContestant(const MethodSpec& method, std::shared_ptr<const TrainingMap> map,
                                           std::uint32_t seed, bool closed);

}  // namespace visual_localization

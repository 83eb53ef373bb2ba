#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/experiment.h"
#include "evaluation/result_folder.h"
#include "evaluation/score_table.h"

namespace visual_localization {

/// Part `index` of `count` of the work, from 1.
struct Shard {
  std::size_t index = 1;
  std::size_t count = 1;

  bool contains(std::size_t pair) const { return pair % count + 1 == index; }
};

/// Makes rounds of what was recorded. May be called from several threads.
struct RoundSource {
  std::function<std::shared_ptr<const TrainingMap>(const RoundSpec&)> map;
  std::function<std::shared_ptr<const Drive>(const RoundSpec&)> drive;
  /// True poses of the images of a round's map; may be missing, and its answer empty, when nothing is known.
  std::function<std::vector<std::optional<TruePose>>(const RoundSpec&, const TrainingMap&)> map_truth = {};
};

/// Says how far a stage of the work is.
using StageProgress = std::function<void(const std::string& stage, std::size_t done, std::size_t total)>;

/// Runs the part `shard` of an experiment and stores what is not stored whole yet. Deterministic but for the times,
/// however many threads there are. Throws ResultError when rounds do not fit together.
void evaluate(const Experiment& experiment, const RoundSource& source, const ResultFolder& results, const Shard& shard,
              std::size_t threads, const StageProgress& progress);

}  // namespace visual_localization

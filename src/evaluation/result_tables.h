#pragma once

#include "evaluation/experiment.h"
#include "evaluation/result_folder.h"

namespace visual_localization {

/// Writes summary.csv, pairs.csv, methods.csv, steps.csv and traces.csv of a complete experiment into its folder.
/// Throws ResultError naming the first result that is missing.
void writeResultTables(const Experiment& experiment, const ResultFolder& results);

}  // namespace visual_localization

#pragma once

#include <map>
#include <string>
#include <vector>

#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// Parameters that belong together, from the bag to the table: config/paper.yaml says what is in it.
struct Preset {
  std::string name;
  ParameterValues map_builder;
  ParameterValues localizer;
  std::map<std::string, ParameterValues> of_tracker;     ///< in place of those of `localizer`, by tracker
  std::map<std::string, std::vector<std::string>> open;  ///< what a configuration may choose, and of what

  /// All that it says of a localizer with this tracker.
  ParameterValues localizerWith(const std::string& tracker) const;
};

/// "paper", "paper_program".
const std::vector<std::string>& presetNames();

/// These, and none: the empty name.
std::vector<std::string> presetChoices();
/// Throws ParameterError unless it is one of presetNames().
const Preset& presetNamed(const std::string& name);

/// `pinned`, the preset's part for one configuration, with what `given` says beside it. Values of `given` that agree
/// with the preset, that are `defaults`, or that choose what is open are no contradiction. Throws ParameterError for
/// the first other one, naming it, its value and what the preset allows.
ParameterValues withPreset(const Preset& preset, const ParameterValues& pinned, const ParameterValues& given,
                           const ParameterValues& defaults = {});

namespace parameters {

/// The preset that `values` name under "preset"; null when they name none. Throws like presetNamed().
const Preset* presetOf(const ParameterValues& values);

}  // namespace parameters

}  // namespace visual_localization

#pragma once

#include <string>
#include <vector>

#include "evaluation/experiment.h"
#include "parameters/yaml_map.h"

namespace visual_localization {

/// A name for tables and messages. Throws ParameterError when it is none.
std::string readName(parameters::YamlMap& yaml, const std::string& key);

/// The methods of an experiment, those that sweeps stand for included. `base`: what they have in common. Throws
/// ParameterError that names the key.
std::vector<MethodSpec> readMethods(parameters::YamlMap& yaml, const LocalizerConfig& base);

}  // namespace visual_localization

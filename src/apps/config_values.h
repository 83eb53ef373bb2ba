#pragma once

#include <string>

#include "apps/app_support.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization::apps {

/// A program's configuration by its file (empty: none) and by the options `given()`, which go before it. `preset`: the
/// option, if given; `complete(values, defaults)` adds a preset's values and refuses what contradicts it.
/// Throws ParameterError, naming the file, and UsageError for an option.
template <class Config, class Given, class Complete>
Config joinedConfig(const std::string& file, const std::string& preset, Given given, Complete complete) {
  Config config;
  const ParameterValues defaults = visual_localization::valuesOf(config);
  ParameterValues of_file;
  if (!file.empty()) {
    try {
      of_file = parameters::readYaml(file);
      if (!preset.empty()) of_file["preset"] = preset;
      assignParameters(config, complete(of_file, defaults));
    } catch (const ParameterError& error) {
      throw ParameterError(file + ": " + error.what());
    }
  }
  try {
    ParameterValues all = given();
    all.insert(of_file.begin(), of_file.end());
    assignParameters(config, complete(all, defaults));
  } catch (const ParameterError& error) {
    throw UsageError(error.what());
  }
  return config;
}

}  // namespace visual_localization::apps

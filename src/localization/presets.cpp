#include "localization/presets.h"

#include "base/text.h"
#include "localization/paper_yaml.h"
#include "parameters/yaml_map.h"

namespace visual_localization {

const std::vector<std::string>& presetNames() {
  static const std::vector<std::string> names{"paper"};
  return names;
}

ParameterValues presetValues(const std::string& name) {
  if (name != presetNames().front()) {
    throw ParameterError("preset '" + oneLine(name, 60) + "' is not allowed: must be one of " + joined(presetNames()));
  }
  return parameters::YamlMap::parse(kPaperYaml, "config/paper.yaml").parameters();
}

}  // namespace visual_localization

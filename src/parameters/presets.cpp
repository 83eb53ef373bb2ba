#include "visual_localization/parameters/presets.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "base/text.h"
#include "parameters/preset_files.h"
#include "parameters/yaml_map.h"

namespace visual_localization {
namespace {

Preset parse(const std::string& name, const char* text) {
  auto yaml = parameters::YamlMap::parse(text, "config/" + name + ".yaml");
  Preset preset{name, yaml.parameters("map_builder"), yaml.parameters("localizer"), {}, {}};
  for (const auto& [key, allowed] : yaml.sweep("open")) preset.open[key] = allowed;
  for (const std::string& tracker : preset.open["tracker"]) preset.of_tracker[tracker] = yaml.parameters(tracker);
  yaml.requireNoMore();
  return preset;
}

const std::vector<Preset>& presets() {
  static const std::vector<Preset> all{parse("paper", kPaperYaml), parse("paper_program", kPaperProgramYaml)};
  return all;
}

/// 10 is 10.0.
bool areEqual(const ParameterValue& a, const ParameterValue& b) {
  const auto number = [](const ParameterValue& value) -> std::optional<double> {
    if (const auto* integer = std::get_if<std::int64_t>(&value)) return static_cast<double>(*integer);
    if (const auto* real = std::get_if<double>(&value)) return *real;
    return std::nullopt;
  };
  const auto number_a = number(a);
  return number_a ? number_a == number(b) : a == b;
}

bool isOpen(const Preset& preset, const std::string& name, const ParameterValue& value) {
  const auto open = preset.open.find(name);
  if (open == preset.open.end()) return false;
  return std::find(open->second.begin(), open->second.end(), parameters::toString(value)) != open->second.end();
}

[[noreturn]] void refuse(const Preset& preset, const std::string& name, const ParameterValue& value,
                         const ParameterValue& pinned) {
  const auto open = preset.open.find(name);
  throw ParameterError(
      "parameter '" + name + "' = " + parameters::toString(value) + " contradicts preset '" + preset.name + "': must " +
      (open == preset.open.end() ? "be " + parameters::toString(pinned) : "be one of " + joined(open->second)));
}

}  // namespace

ParameterValues Preset::localizerWith(const std::string& tracker) const {
  ParameterValues values = localizer;
  const auto own = of_tracker.find(tracker);
  if (own != of_tracker.end()) {
    for (const auto& [key, value] : own->second) values[key] = value;
  }
  return values;
}

const std::vector<std::string>& presetNames() {
  static const std::vector<std::string> names{"paper", "paper_program"};
  return names;
}

std::vector<std::string> presetChoices() {
  std::vector<std::string> choices = presetNames();
  choices.insert(choices.begin(), "");
  return choices;
}

const Preset& presetNamed(const std::string& name) {
  for (const Preset& preset : presets()) {
    if (preset.name == name) return preset;
  }
  throw ParameterError("preset '" + oneLine(name, 60) + "' is not allowed: must be one of " + joined(presetNames()));
}

ParameterValues withPreset(const Preset& preset, const ParameterValues& pinned, const ParameterValues& given,
                           const ParameterValues& defaults) {
  ParameterValues joined_values = given;
  for (const auto& [name, value] : pinned) {
    const auto set = given.find(name);
    const auto usual = defaults.find(name);
    const bool says_so = set != given.end() && !(usual != defaults.end() && areEqual(set->second, usual->second));
    if (says_so && isOpen(preset, name, set->second)) continue;
    if (says_so && !areEqual(set->second, value)) refuse(preset, name, set->second, value);
    joined_values[name] = value;
  }
  return joined_values;
}

namespace parameters {

const Preset* presetOf(const ParameterValues& values) {
  const auto found = values.find("preset");
  if (found == values.end() || toString(found->second).empty()) return nullptr;
  return &presetNamed(toString(found->second));
}

}  // namespace parameters

}  // namespace visual_localization

#include "evaluation/experiment.h"

#include <algorithm>
#include <array>
#include <limits>
#include <set>
#include <utility>

#include "base/text.h"
#include "parameters/yaml_map.h"
#include "visual_localization/localization/localizer_config.h"
#include "visual_localization/localization/tracker.h"
#include "visual_localization/parameters/presets.h"

namespace visual_localization {
namespace {

using parameters::YamlMap;
using Setting = std::pair<std::string, std::string>;

constexpr std::size_t kMostCombinations = 10000;
constexpr std::size_t kMostMethods = 10000;
constexpr std::size_t kLongestName = 1000;

/// Throws ParameterError when it is no name for tables and messages.
std::string readName(YamlMap& yaml, const std::string& key) {
  std::string name = yaml.text(key);
  if (name.empty() || name.find('\n') != std::string::npos) yaml.refuse(key, "must be a name of one line");
  return name;
}

/// A number of a method itself, not a parameter.
struct MethodNumber {
  const char* key;
  double MethodSpec::*value;
  double min;
  double max;
};
constexpr std::array<MethodNumber, 2> kMethodNumbers{
    {{"speed", &MethodSpec::speed, 1.0 / 64.0, 64.0}, {"map_spacing", &MethodSpec::map_spacing_m, 0.0, 1000.0}}};

const MethodNumber* numberCalled(const std::string& key) {
  const auto* found = std::find_if(kMethodNumbers.begin(), kMethodNumbers.end(),
                                   [&key](const MethodNumber& number) { return key == number.key; });
  return found == kMethodNumbers.end() ? nullptr : found;
}

using Sweep = std::vector<std::pair<std::string, std::vector<std::string>>>;

/// What a method's entry sweeps over; not what it sets as well.
Sweep readSweep(YamlMap& yaml, const ParameterValues& parameters) {
  Sweep sweep = yaml.sweep("sweep");
  std::size_t combinations = 1;
  for (const auto& [key, values] : sweep) {
    if (parameters.count(key) != 0 || (numberCalled(key) != nullptr && yaml.has(key))) {
      yaml.refuse("sweep/" + key, "is set for this method already");
    }
    combinations *= values.size();
    if (combinations > kMostCombinations) {
      yaml.refuse("sweep", "has more than " + std::to_string(kMostCombinations) + " combinations");
    }
  }
  return sweep;
}

/// The last key changes fastest; one empty combination without a sweep.
std::vector<std::vector<Setting>> combinationsOf(const Sweep& sweep) {
  std::vector<std::vector<Setting>> combinations{{}};
  for (const auto& [key, values] : sweep) {
    std::vector<std::vector<Setting>> longer;
    for (const auto& combination : combinations) {
      for (const std::string& value : values) {
        longer.push_back(combination);
        longer.back().emplace_back(key, value);
      }
    }
    combinations = std::move(longer);
  }
  return combinations;
}

std::string withValues(std::string name, const std::vector<Setting>& settings, const YamlMap& yaml) {
  for (const auto& [key, value] : settings) {
    const std::string placeholder = "{" + key + "}";
    for (auto at = name.find(placeholder); at != std::string::npos; at = name.find(placeholder, at + value.size())) {
      name.replace(at, placeholder.size(), value);
      if (name.size() > kLongestName) yaml.refuse("name", "= '" + name.substr(0, 100) + "...' becomes too long");
    }
  }
  return name;
}

bool concernsFrontEnd(const std::string& parameter) {
  return parameter.rfind("match/", 0) == 0 || parameter == "prune";
}

/// What the entry of one method says before the sweep's values are filled in.
struct MethodEntry {
  std::string name;
  MethodSpec method;
  ParameterValues parameters;
};

void applyParameters(MethodEntry& entry, const YamlMap& yaml) {
  for (const auto& [key, value] : entry.parameters) {
    if (concernsFrontEnd(key)) yaml.refuse("parameters", "'" + key + "' holds for all methods: set it at the top");
    if (isOfOtherTrackers(key, entry.method.tracker)) {
      yaml.refuse("parameters", "of '" + entry.method.name + "': '" + key + "' changes nothing with tracker '" +
                                    entry.method.tracker + "'");
    }
    entry.method.settings.emplace_back(key, parameters::toString(value));
  }
  try {
    if (entry.method.isTracker()) {
      entry.parameters["tracker"] = entry.method.tracker;
      assignParameters(entry.method.localizer, entry.parameters);
    } else {
      assignParameters(entry.method.recogniser, entry.parameters);
    }
  } catch (const ParameterError& error) {
    yaml.refuse("parameters", std::string("of '") + entry.method.name + "': " + error.what());
  }
}

double sweptNumber(const MethodNumber& number, const std::string& text, const YamlMap& yaml) {
  const ParameterValue value = parameters::parseScalar(text);
  const auto* whole = std::get_if<std::int64_t>(&value);
  const auto* real = std::get_if<double>(&value);
  const double swept = whole != nullptr  ? static_cast<double>(*whole)
                       : real != nullptr ? *real
                                         : std::numeric_limits<double>::quiet_NaN();
  if (swept >= number.min && swept <= number.max) return swept;
  yaml.refuse("sweep", std::string(number.key) + " = " + text + " must be a number in [" +
                           parameters::toString(number.min) + ", " + parameters::toString(number.max) + "]");
}

MethodSpec completed(MethodEntry entry, const std::vector<Setting>& swept, const YamlMap& yaml) {
  MethodSpec& method = entry.method;
  method.name = withValues(entry.name, swept, yaml);
  for (const auto& [key, value] : swept) {
    if (const MethodNumber* number = numberCalled(key)) {
      method.*number->value = sweptNumber(*number, value, yaml);
    } else {
      entry.parameters[key] = parameters::parseScalar(value);
    }
  }
  method.settings = {{"tracker", method.tracker},
                     {"features", method.localizer.features},
                     {"speed", parameters::toString(method.speed)},
                     {"kidnapped", method.kidnapped ? "true" : "false"},
                     {"map_gap", parameters::toString(method.map_gap)},
                     {"covered", parameters::toString(method.covered)}};
  if (method.map_spacing_m > 0.0) {
    method.settings.emplace_back("map_spacing", parameters::toString(method.map_spacing_m));
  }
  applyParameters(entry, yaml);
  return method;
}

/// What methods have in common: the preset, if there is one, and the parameters at the top.
struct CommonParameters {
  const Preset* preset = nullptr;
  ParameterValues given;

  /// For a method with this tracker. Throws ParameterError.
  LocalizerConfig configFor(const std::string& tracker) const {
    LocalizerConfig config;
    if (preset != nullptr) assignParameters(config, {{"preset", preset->name}});
    assignParameters(config, preset == nullptr ? given : withPreset(*preset, preset->localizerWith(tracker), given));
    return config;
  }
};

std::vector<MethodSpec> readMethod(YamlMap& yaml, const CommonParameters& common) {
  MethodEntry entry;
  entry.name = readName(yaml, "name");
  entry.method.tracker = yaml.text("tracker");
  const std::vector<std::string>& recognisers = placeRecogniserNames();
  const bool is_recogniser =
      std::find(recognisers.begin(), recognisers.end(), entry.method.tracker) != recognisers.end();
  try {
    entry.method.localizer = common.configFor(entry.method.tracker);
    ParameterValues chosen{{"features", yaml.text("features", entry.method.localizer.features)}};
    if (!is_recogniser) chosen["tracker"] = entry.method.tracker;
    assignParameters(entry.method.localizer, chosen);
  } catch (const ParameterError& error) {
    yaml.refuse("name",
                "'" + entry.name + "': " + error.what() + " (beside the trackers: " + joined(recognisers) + ")");
  }
  if (is_recogniser && entry.method.localizer.features == "hybrid") {
    yaml.refuse("features", "= hybrid needs a tracker's cloud, and '" + entry.method.tracker + "' has none");
  }
  for (const MethodNumber& number : kMethodNumbers) {
    entry.method.*number.value = yaml.real(number.key, entry.method.*number.value, number.min, number.max);
  }
  entry.method.kidnapped = yaml.flag("kidnapped", false);
  entry.method.map_gap = yaml.real("map_gap", 0.0, 0.0, 0.6);
  entry.method.covered = yaml.real("covered", 0.0, 0.0, 0.5);
  entry.parameters = yaml.parameters("parameters");
  std::vector<MethodSpec> methods;
  for (const auto& swept : combinationsOf(readSweep(yaml, entry.parameters)))
    methods.push_back(completed(entry, swept, yaml));
  yaml.requireNoMore();
  return methods;
}

/// Those that sweeps stand for included. Throws ParameterError that names the key.
std::vector<MethodSpec> readMethods(YamlMap& yaml, const CommonParameters& common) {
  std::vector<MethodSpec> methods;
  std::set<std::string> names;
  for (YamlMap& entry : yaml.maps("methods")) {
    for (MethodSpec& method : readMethod(entry, common)) {
      if (!names.insert(method.name).second) entry.refuse("name", "= '" + method.name + "' appears twice");
      methods.push_back(std::move(method));
    }
    if (methods.size() > kMostMethods) {
      yaml.refuse("methods", "and their sweeps are more than " + std::to_string(kMostMethods) + " methods");
    }
  }
  return methods;
}

constexpr std::size_t kMostStarts = 1000000;
constexpr std::size_t kMostSeeds = 1000;

Pruning readPruning(YamlMap& yaml) {
  const std::string name = yaml.text("pruning", "previous");
  if (name == "previous") return Pruning::kPrevious;
  if (name == "both") return Pruning::kBoth;
  if (name != "none") yaml.refuse("pruning", "= '" + name + "' must be previous, both or none");
  return Pruning::kNone;
}

Accuracy readAccuracy(YamlMap& yaml, const Accuracy& common) {
  const Accuracy accuracy{yaml.real("right", common.right_m, 0.001, 1e5),
                          yaml.real("wrong", common.wrong_m, 0.001, 1e5)};
  if (accuracy.wrong_m < accuracy.right_m) {
    yaml.refuse("wrong", "= " + parameters::toString(accuracy.wrong_m) +
                             " must not be below right = " + parameters::toString(accuracy.right_m));
  }
  return accuracy;
}

std::vector<RoundSpec> readRounds(YamlMap& yaml) {
  std::vector<RoundSpec> rounds;
  RoundSpec common;
  common.image_topic = yaml.text("image_topic", "/stereo/left/image_raw");
  common.fix_topic = yaml.text("fix_topic", "/gps/fix");
  common.truth_topic = yaml.text("truth_topic", common.fix_topic);
  common.camera_info = yaml.text("camera_info", "");
  common.accuracy = readAccuracy(yaml, common.accuracy);
  std::set<std::string> names;
  for (YamlMap& bag : yaml.maps("bags")) {
    RoundSpec round;
    round.name = bag.text("name");
    round.bag = bag.text("bag");
    round.group = bag.text("group", round.name);
    round.image_topic = bag.text("image_topic", common.image_topic);
    round.fix_topic = bag.text("fix_topic", common.fix_topic);
    round.truth_topic = bag.text("truth_topic", common.truth_topic);
    round.camera_info = bag.text("camera_info", common.camera_info);
    round.poses = bag.text("poses", "");
    round.accuracy = readAccuracy(bag, common.accuracy);
    round.pruning = readPruning(bag);
    bag.requireNoMore();
    const bool usable = !round.name.empty() && round.name.find_first_of("/ ,\"\n") == std::string::npos;
    if (!usable) bag.refuse("name", "= '" + round.name + "' must be a name without slash, comma, quote or space");
    if (!names.insert(round.name).second) bag.refuse("name", "= '" + round.name + "' appears twice");
    rounds.push_back(std::move(round));
  }
  if (rounds.size() < 2) yaml.refuse("bags", "has one round only; a map and another round to drive are needed");
  return rounds;
}

/// One round, or all of a group.
std::vector<std::size_t> roundsNamed(const std::string& name, const std::vector<RoundSpec>& rounds) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < rounds.size(); ++i) {
    if (rounds[i].name == name) return {i};
    if (rounds[i].group == name) found.push_back(i);
  }
  return found;
}

std::vector<PairSpec> readPairs(YamlMap& yaml, const std::vector<RoundSpec>& rounds) {
  std::vector<PairSpec> pairs;
  for (const std::vector<std::string>& names : yaml.textLists("pairs", 2)) {
    const std::string shown = "[" + joined(names) + "]";
    for (const std::string& name : names) {
      if (roundsNamed(name, rounds).empty())
        yaml.refuse("pairs", shown + ": no round or group is called '" + name + "'");
    }
    const std::size_t before = pairs.size();
    for (const std::size_t map : roundsNamed(names[0], rounds)) {
      for (const std::size_t drive : roundsNamed(names[1], rounds)) {
        if (map != drive) pairs.push_back({map, drive});
      }
    }
    if (pairs.size() == before) yaml.refuse("pairs", shown + " needs two different rounds, but there is one only");
  }
  std::set<std::pair<std::size_t, std::size_t>> seen;
  for (const PairSpec& pair : pairs) {
    if (seen.insert({pair.map, pair.drive}).second) continue;
    yaml.refuse("pairs",
                "name the pair of map " + rounds[pair.map].name + " and drive " + rounds[pair.drive].name + " twice");
  }
  return pairs;
}

/// Throws ParameterError unless some method's tracker uses each of the parameters at the top.
void requireUsed(const YamlMap& yaml, const ParameterValues& given, const std::vector<MethodSpec>& methods) {
  for (const auto& [key, value] : given) {
    const auto ignores = [&key = key](const MethodSpec& method) { return isOfOtherTrackers(key, method.tracker); };
    if (!std::all_of(methods.begin(), methods.end(), ignores)) continue;
    yaml.refuse("parameters", "'" + key + "' changes nothing: no method has a tracker that uses it");
  }
}

/// Landmarks only where the experiment says so.
MapBuilderConfig mapConfig(YamlMap& yaml, const Preset* preset) {
  MapBuilderConfig config;
  config.geometry.enabled = false;
  try {
    ParameterValues values = yaml.parameters("map_parameters");
    if (preset != nullptr) {
      values["preset"] = preset->name;
      values = withPreset(*preset, preset->map_builder, values);
    }
    assignParameters(config, values);
  } catch (const ParameterError& error) {
    yaml.refuse("map_parameters", error.what());
  }
  return config;
}

const Preset* readPreset(YamlMap& yaml, const std::string& instead) {
  const std::string name = yaml.text("preset", "");
  try {
    const std::string& chosen = instead.empty() ? name : instead;
    return chosen.empty() ? nullptr : &presetNamed(chosen);
  } catch (const ParameterError& error) {
    yaml.refuse("preset", error.what());
  }
}

Experiment parse(YamlMap yaml, const std::string& preset_instead) {
  Experiment experiment;
  experiment.name = readName(yaml, "experiment");
  for (const char* for_the_report : {"title", "source"}) yaml.text(for_the_report, "");
  YamlMap rounds = yaml.map("rounds");
  experiment.closed = rounds.flag("closed", true);
  experiment.rounds = readRounds(rounds);
  rounds.requireNoMore();
  experiment.pairs = readPairs(yaml, experiment.rounds);
  if (yaml.text("starts", "all") != "all") experiment.starts = yaml.count("starts", 0, 1, kMostStarts);
  experiment.start_every = yaml.count("start_every", 0, 0, kMostStarts);
  if (experiment.start_every > 0 && experiment.starts > 0) yaml.refuse("start_every", "and starts exclude each other");
  experiment.run_images = yaml.count("run_images", 0, 0, kMostStarts);
  experiment.judge_from = yaml.count("judge_from", 0, 0, kMostStarts);
  experiment.found_within_m = yaml.real("found_within", experiment.found_within_m, 0.001, 1000.0);
  experiment.trace_start = yaml.count("trace_start", 0, 0, kMostStarts);
  experiment.seeds = yaml.count("seeds", 1, 1, kMostSeeds);
  const CommonParameters common{readPreset(yaml, preset_instead), yaml.parameters("parameters")};
  experiment.map = mapConfig(yaml, common.preset);
  try {
    experiment.front_end = common.configFor("");
  } catch (const ParameterError& error) {
    yaml.refuse("parameters", error.what());
  }
  experiment.methods = readMethods(yaml, common);
  requireUsed(yaml, common.given, experiment.methods);
  yaml.requireNoMore();
  return experiment;
}

}  // namespace

bool MethodSpec::isTracker() const {
  const std::vector<std::string>& recognisers = placeRecogniserNames();
  return std::find(recognisers.begin(), recognisers.end(), tracker) == recognisers.end();
}

bool Experiment::solvesPoses() const {
  return map.geometry.enabled && std::any_of(methods.begin(), methods.end(), [](const MethodSpec& method) {
           return method.isTracker() && method.localizer.metric.pose_source == "metric";
         });
}

Experiment parseExperiment(const std::string& yaml, const std::string& path, const std::string& preset) {
  return parse(YamlMap::parse(yaml, path), preset);
}

}  // namespace visual_localization

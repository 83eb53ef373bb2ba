#include "evaluation/experiment.h"

#include <algorithm>
#include <set>

#include "base/text.h"
#include "evaluation/experiment_methods.h"
#include "localization/presets.h"
#include "parameters/yaml_map.h"

namespace visual_localization {
namespace {

using parameters::YamlMap;

constexpr std::size_t kMostStarts = 1000000;

std::vector<RoundSpec> readRounds(YamlMap& yaml) {
  std::vector<RoundSpec> rounds;
  RoundSpec common;
  common.image_topic = yaml.text("image_topic", "/stereo/left/image_raw");
  common.fix_topic = yaml.text("fix_topic", "/gps/fix");
  common.truth_topic = yaml.text("truth_topic", common.fix_topic);
  common.camera_info = yaml.text("camera_info", "");
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
    bag.requireNoMore();
    const bool usable = !round.name.empty() && round.name.find_first_of("/ ,\"\n") == std::string::npos;
    if (!usable) bag.refuse("name", "= '" + round.name + "' must be a name without slash, comma, quote or space");
    if (!names.insert(round.name).second) bag.refuse("name", "= '" + round.name + "' appears twice");
    rounds.push_back(std::move(round));
  }
  if (rounds.size() < 2) yaml.refuse("bags", "has one round only; a map and another round to drive are needed");
  return rounds;
}

/// The rounds that a name of a pair stands for: one round, or all of a group.
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

/// As in the papers, unless the experiment says otherwise.
MapBuilderConfig placesOnly() {
  MapBuilderConfig config;
  config.geometry.enabled = false;
  return config;
}

template <class Config>
Config configured(YamlMap& yaml, const std::string& key, Config config = {}) {
  try {
    assignParameters(config, yaml.parameters(key));
  } catch (const ParameterError& error) {
    yaml.refuse(key, error.what());
  }
  return config;
}

/// Defaults, then the preset, then what the experiment says.
LocalizerConfig localizerConfig(YamlMap& yaml) {
  LocalizerConfig config;
  const std::string preset = yaml.text("preset", "");
  try {
    if (!preset.empty()) assignParameters(config, presetValues(preset));
  } catch (const ParameterError& error) {
    yaml.refuse("preset", error.what());
  }
  return configured(yaml, "parameters", config);
}

Experiment parse(YamlMap yaml) {
  Experiment experiment;
  experiment.name = readName(yaml, "experiment");
  for (const char* for_the_report : {"title", "source", "discussion"}) yaml.text(for_the_report, "");
  YamlMap rounds = yaml.map("rounds");
  experiment.closed = rounds.flag("closed", true);
  experiment.rounds = readRounds(rounds);
  rounds.requireNoMore();
  experiment.pairs = readPairs(yaml, experiment.rounds);
  if (yaml.text("starts", "all") != "all") experiment.starts = yaml.count("starts", 0, 1, kMostStarts);
  experiment.found_within_m = yaml.real("found_within", experiment.found_within_m, 0.001, 1000.0);
  experiment.trace_start = yaml.count("trace_start", 0, 0, kMostStarts);
  experiment.map = configured(yaml, "map_parameters", placesOnly());
  experiment.front_end = localizerConfig(yaml);
  experiment.methods = readMethods(yaml, experiment.front_end);
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

Experiment parseExperiment(const std::string& yaml, const std::string& path) {
  return parse(YamlMap::parse(yaml, path));
}

}  // namespace visual_localization

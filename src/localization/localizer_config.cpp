#include "visual_localization/localization/localizer_config.h"

#include <algorithm>
#include <limits>

#include "base/text.h"
#include "visual_localization/features/sift.h"
#include "visual_localization/localization/tracker.h"
#include "visual_localization/parameters/presets.h"

namespace visual_localization {
namespace {

constexpr bool kAtStartOnly = true;

}  // namespace

void LocalizerConfig::declare(ParameterVisitor& visitor) {
  visitor.choice(
      {"preset", "",
       "parameters of the papers' text or of the authors' program in place of the defaults; a map built with "
       "the same one is needed, and other values are refused beside it",
       kAtStartOnly},
      preset, presetChoices());
  visitor.choice({"tracker", "",
                  "dynamic particle swarm, several swarms, particle filter with Gaussian or linear motion, or discrete "
                  "Bayes filter "
                  "over the training images"},
                 tracker, trackerNames());
  std::vector<std::string> names = localFeatureNames();
  names.insert(names.end(), {"global", "hybrid"});
  visitor.choice({"features", "",
                  "what images are compared by: the map's kind of local features, global features, or hybrid: global "
                  "features, local ones when the cloud spreads"},
                 features, names);
  visitor.text({"model", "", "ONNX file of learned features, the one that the map was built with", kAtStartOnly},
               model);
  visitor.choice(
      {"estimate", "",
       "position without landmarks: that of the best particle, as in the papers (image), or on the path of the "
       "most similar training image, by how large things look; of the tracker bayes the mean of that and of its "
       "posterior (interpolated; local features only)"},
      estimate, {"image", "interpolated"});
  visitor.integer(
      {"seed", "1", "of the random generator; the same seed, map and images give the same track", kAtStartOnly}, seed,
      0, std::numeric_limits<int>::max());
  visitor.flag({"prune", "", "keep only features that the image before showed as well"}, prune);
  visitor.flag({"choose_session", "", "in a map of several sessions, compare with the one that matches best lately"},
               choose_session);
  visitor.integer(
      {"sweep_images", "1",
       "of a larger map, guided recovery, place check and proposals for poses compare about this number per image"},
      sweep_images, 1, std::numeric_limits<int>::max());
  visitor.choice(
      {"proposals", "",
       "which images of the map may look like this one: by VLAD of the local features, where the map has it, "
       "or by global features"},
      proposals, {"vlad", "global"});
  match.declare(visitor);
  similarity.declare(visitor);
  hybrid.declare(visitor);
  fitness.declare(visitor);
  state.declare(visitor);
  metric.declare(visitor);
  dpso.declare(visitor);
  pf.declare(visitor);
  bayes.declare(visitor);
  odometry.declare(visitor);
  constexpr int kLeastOfSwarm = 4;
  visitor.require(tracker != "dpso_multi" || dpso.particles >= kLeastOfSwarm * dpso.swarms, "dpso/particles",
                  parameters::toString(dpso.particles),
                  "at least 4 for each of 'dpso/swarms' = " + parameters::toString(dpso.swarms));
}

FrontEndConfig frontEndConfigOf(const LocalizerConfig& config, const MapHeader& map) {
  const std::vector<std::string> allowed{map.kind->name(), "global", "hybrid"};
  if (std::find(allowed.begin(), allowed.end(), config.features) == allowed.end()) {
    throw ParameterError("parameter 'features' = '" + config.features + "' is not allowed with this map, whose local " +
                         "features are '" + map.kind->name() + "': must be one of " + joined(allowed));
  }
  FrontEndConfig front_end{map.image_size, map.kind, config.match, config.prune};
  front_end.model = config.model;
  if (!map.sessions.empty()) front_end.mask = map.sessions.front().mask;  // until somebody gives another camera's
  return front_end;
}

ParameterValues localizerValues(const ParameterValues& given, const ParameterValues& defaults) {
  const Preset* preset = parameters::presetOf(given);
  if (preset == nullptr) return given;
  ParameterValues chosen = withPreset(*preset, {{"tracker", preset->localizer.at("tracker")}}, given, defaults);
  const std::string tracker = parameters::toString(chosen["tracker"]);
  return withPreset(*preset, preset->localizerWith(tracker), given, defaults);
}

namespace {

/// Where its local features are others, in words.
std::string otherFeatures(const ParameterValues& wanted, const LocalFeatureKind& kind) {
  std::string differences;
  for (const auto& [name, value] : kind.parameters()) {
    const auto pinned = wanted.find(name);
    if (pinned == wanted.end() || parameters::toString(pinned->second) == parameters::toString(value)) continue;
    differences +=
        ", '" + name + "' = " + parameters::toString(value) + " instead of " + parameters::toString(pinned->second);
  }
  return differences;
}

}  // namespace

void requirePresetFits(const LocalizerConfig& config, const TrainingMap& map) {
  if (config.preset.empty()) return;
  const ParameterValues& wanted = presetNamed(config.preset).map_builder;
  const MapHeader& header = map.header();
  if (!header.preset.empty() && presetNamed(header.preset).map_builder == wanted) return;
  throw ParameterError("preset '" + config.preset + "' is not allowed with this map, which was not built with it" +
                       otherFeatures(wanted, *header.kind) + (map.hasGeometry() ? ", adjusted positions" : "") +
                       ": build one with map_builder --preset " + config.preset);
}

}  // namespace visual_localization

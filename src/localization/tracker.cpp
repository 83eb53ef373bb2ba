#include "visual_localization/localization/tracker.h"

#include <algorithm>
#include <stdexcept>

#include "base/text.h"
#include "localization/bayes_tracker.h"
#include "localization/papers/dpso.h"
#include "localization/papers/multi_swarm.h"
#include "localization/papers/particle_filter.h"
#include "visual_localization/localization/tracker_config.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

void TrackerReport::set(const char* key, double value) {
  for (std::size_t i = 0; i < size_; ++i) {
    if (key != std::string_view(entries_[i].key)) continue;
    entries_[i].value = value;
    return;
  }
  if (size_ == kMost) throw std::length_error("a tracker reports too much: " + std::string(key));
  entries_[size_++] = {key, value};
}

double TrackerReport::value(std::string_view key) const {
  for (std::size_t i = 0; i < size_; ++i) {
    if (key == entries_[i].key) return entries_[i].value;
  }
  return 0.0;
}

namespace {

template <class Kind>
std::unique_ptr<Tracker> make(const TrainingMap& map, const TrackerConfig& config, std::uint32_t seed) {
  return std::make_unique<Kind>(map, config, seed);
}

std::vector<TrackerKind>& registry() {
  static std::vector<TrackerKind> kinds{
      {"dpso", "dpso/particles", make<Dpso>, {"dpso/", "recovery"}},
      {"dpso_multi", "dpso/particles", make<MultiSwarm>, {"dpso/", "recovery"}},
      {"pf_gaussian", "pf/particles", make<ParticleFilter>, {"pf/"}},
      {"pf_linear", "pf/particles", make<ParticleFilter>, {"pf/"}},
      {"bayes", "pf/particles", make<BayesTracker>},
  };
  return kinds;
}

const TrackerKind* find(const std::string& name) {
  for (const TrackerKind& kind : registry()) {
    if (kind.name == name) return &kind;
  }
  return nullptr;
}

}  // namespace

void registerTracker(const TrackerKind& kind) {
  if (find(kind.name) != nullptr) throw std::invalid_argument("there is a tracker '" + kind.name + "' already");
  registry().push_back(kind);
}

const TrackerKind& trackerKind(const std::string& name) {
  if (const TrackerKind* kind = find(name)) return *kind;
  throw ParameterError("tracker '" + oneLine(name, 60) + "' is not allowed: must be one of " + joined(trackerNames()));
}

std::vector<std::string> trackerNames() {
  std::vector<std::string> names;
  for (const TrackerKind& kind : registry()) names.push_back(kind.name);
  return names;
}

bool isOfOtherTrackers(const std::string& parameter, const std::string& tracker) {
  const auto uses = [&parameter](const TrackerKind& kind) {
    return std::any_of(kind.parameters.begin(), kind.parameters.end(),
                       [&parameter](const std::string& start) { return parameter.rfind(start, 0) == 0; });
  };
  const TrackerKind* own = find(tracker);
  return !(own != nullptr && uses(*own)) && std::any_of(registry().begin(), registry().end(), uses);
}

std::unique_ptr<Tracker> makeTracker(const TrainingMap& map, const TrackerConfig& config, std::uint32_t seed) {
  return trackerKind(config.tracker).make(map, config, seed);
}

}  // namespace visual_localization

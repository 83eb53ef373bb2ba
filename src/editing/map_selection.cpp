#include "editing/map_selection.h"

#include <algorithm>
#include <utility>

#include "base/text.h"
#include "map/map_geometry.h"
#include "map/map_writer.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization {
namespace {

/// The header with the sessions that are left, and the new number of each.
std::pair<MapHeader, std::vector<int>> remaining(const TrainingMap& map, const std::vector<bool>& keep) {
  std::vector<bool> used(map.header().sessions.size(), false);
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (keep[i]) used[static_cast<std::size_t>(map.pose(i).session)] = true;
  }
  MapHeader header = map.header();
  header.sessions.clear();
  std::vector<int> numbers(used.size(), 0);
  for (std::size_t s = 0; s < used.size(); ++s) {
    numbers[s] = static_cast<int>(header.sessions.size());
    if (used[s]) header.sessions.push_back(map.header().sessions[s]);
  }
  return {std::move(header), std::move(numbers)};
}

}  // namespace

void writeSelection(const TrainingMap& map, const std::vector<bool>& keep, const std::string& edit,
                    const std::string& path, const Progress& progress,
                    const std::function<void(TrainingImage&)>& change) {
  if (std::find(keep.begin(), keep.end(), true) == keep.end()) throw MapEditError("no image would be left");
  auto [header, numbers] = remaining(map, keep);
  if (!edit.empty()) header.history.push_back(edit);
  MapWriter writer(path);
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (keep[i]) {
      TrainingImage image = map.image(i);
      image.session = numbers[static_cast<std::size_t>(image.session)];
      if (change) change(image);
      writer.append(image);
    }
    if (progress) progress(i + 1, map.size());
  }
  writer.finish(header);
}

std::vector<bool> withoutSession(const TrainingMap& map, const std::string& name) {
  const std::vector<Session>& sessions = map.header().sessions;
  std::vector<std::string> names;
  for (const Session& session : sessions) names.push_back("'" + session.name + "'");
  const bool known = std::any_of(sessions.begin(), sessions.end(), [&](const Session& s) { return s.name == name; });
  if (!known) throw MapEditError("has no session '" + name + "', but " + joined(names, ", "));
  std::vector<bool> keep(map.size());
  for (std::size_t i = 0; i < map.size(); ++i) {
    keep[i] = sessions[static_cast<std::size_t>(map.pose(i).session)].name != name;
  }
  return keep;
}

std::vector<bool> spaced(const TrainingMap& map, double spacing_m) {
  std::vector<SpacingFilter> filters(map.header().sessions.size(), SpacingFilter(spacing_m));
  std::vector<bool> keep(map.size());
  for (std::size_t i = 0; i < map.size(); ++i) {
    keep[i] = filters[static_cast<std::size_t>(map.pose(i).session)].keeps(map.position_m(i));
  }
  return keep;
}

}  // namespace visual_localization

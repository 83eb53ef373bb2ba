#include <array>
#include <filesystem>
#include <functional>
#include <iomanip>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <pwd.h>
#include <unistd.h>

#include "apps/app_support.h"
#include "apps/bag_sessions.h"
#include "apps/build_report.h"
#include "apps/command_line.h"
#include "apps/region.h"
#include "base/files.h"
#include "base/text.h"
#include "editing/map_merger.h"
#include "editing/map_selection.h"
#include "editing/map_usage.h"
#include "map/map_writer.h"
#include "visual_localization/map/map_builder.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization::apps {
namespace {

constexpr std::size_t kCache_bytes = std::size_t{512} << 20U;  ///< of all maps together
constexpr std::size_t kMostText_bytes = std::size_t{256} << 20U;

std::string user() {
  const passwd* entry = ::getpwuid(::geteuid());
  return entry == nullptr ? std::to_string(::geteuid()) : entry->pw_name;
}

std::string host() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "?";
}

/// For MapHeader::history: what was done, from which files, by which version, and by whom: "merge of north.map,
/// south.map by map_edit 0.2.0, anna@workshop".
std::string provenance(const std::string& command, const std::vector<std::string>& from) {
  constexpr std::size_t kLongest = 4000;  // a job of a thousand maps names the first hundred
  std::vector<std::string> names;
  for (const std::string& path : from) names.push_back(std::filesystem::path(path).filename().string());
  return oneLine(command + " of " + joined(names), kLongest) + " by map_edit " + VISUAL_LOCALIZATION_VERSION + ", " +
         oneLine(user() + "@" + host());
}

std::shared_ptr<const TrainingMap> openMap(const std::string& path, std::size_t of = 1) {
  return loadMap(path, strictLoading(kCache_bytes / of));
}

/// Refuses what could only fail after the work.
void requireOutput(const MapEditOptions& options, std::vector<std::string> inputs) {
  inputs.push_back(options.map);
  inputs.insert(inputs.end(), options.maps.begin(), options.maps.end());
  requireNoInput("--output", options.output, inputs);
  const PartialFile attempt(options.output);
}

void printMerged(const MergedMap& map) {
  std::cout << oneLine(map.name) << ": " << map.images << " images, " << map.with_landmarks << " with landmarks; ";
  if (map.tied > 0) {
    std::cout << map.tied << " see landmarks of the maps before, which had the same " << std::fixed
              << std::setprecision(2) << map.apart_m << " m away; now " << map.left_m << " m (medians)\n";
  } else if (map.with_landmarks == 0) {
    std::cout << "without landmarks it lies where its fixes have it\n";
  } else {
    std::cout << "overlaps with no map before: it lies where its fixes have it\n";
  }
}

std::string describe(const TrainingMap& map) {
  const std::size_t sessions = map.header().sessions.size();
  return std::to_string(map.size()) + " images, " + std::to_string(sessions) +
         (sessions == 1 ? " session" : " sessions");
}

void printSummary(const std::string& path) {
  const auto map = loadMap(path, strictLoading(0));  // what images look like stays in the file
  std::cout << oneLine(path) << ": " << describe(*map) << ", "
            << humanSize(static_cast<double>(std::filesystem::file_size(path))) << '\n';
}

std::vector<MergedMap> merge(const std::vector<NamedMap>& maps, const MapEditOptions& options,
                             const std::vector<std::string>& from) {
  ProgressBar bar("aligning");
  return mergeMaps(maps, provenance(options.command, from), options.output, options.build.threads,
                   [&bar](std::size_t done, std::size_t total) { bar.show(done, total); });
}

/// The first one stays.
void printAllMerged(const std::vector<MergedMap>& merged) {
  std::cout << oneLine(merged.front().name) << ": " << merged.front().images << " images, stays where it is\n";
  for (std::size_t k = 1; k < merged.size(); ++k) printMerged(merged[k]);
}

void mergeFiles(const MapEditOptions& options) {
  requireDifferent("map", options.maps);
  requireOutput(options, {});
  const OutputLock lock(options.output);
  std::vector<NamedMap> maps;
  for (const std::string& path : options.maps) maps.push_back({path, openMap(path, options.maps.size())});
  maps = inOrderOfTime(std::move(maps));
  std::vector<std::string> names;
  for (const NamedMap& map : maps) names.push_back(map.name);
  printAllMerged(merge(maps, options, names));
}

void addBags(const MapEditOptions& options) {
  requireDifferent("--bag", options.build.bags);
  std::vector<std::string> inputs = options.build.bags;
  inputs.insert(inputs.end(), {options.build.config, options.build.camera_info, options.build.mask});
  requireOutput(options, inputs);
  const OutputLock lock(options.output);
  const auto map = openMap(options.map, 2);
  MapBuilderConfig config = readConfig(options.build);
  config.sift = map->header().sift;
  MapBuilder builder(config, {options.build.threads, options.output},
                     MapBase{map->header().datum, map->header().image_size});
  std::vector<PlottedSession> sessions;
  for (const std::string& bag : options.build.bags) addSession(builder, bag, options.build, config, sessions);
  const PartialFile added(options.output);
  {
    ProgressBar bar("pruning features");
    builder.save(added, [&bar](std::size_t done, std::size_t total) { bar.show(done, total); });
  }
  printReport(options.build, builder.report(), config.geometry, sessions);
  std::vector<std::string> from{options.map};
  from.insert(from.end(), options.build.bags.begin(), options.build.bags.end());
  const std::string name = joined(options.build.bags);
  printAllMerged(merge({{options.map, map}, {name, openMap(added.path(), 2)}}, options, from));
}

/// A new map of some images of one.
template <class Choose>
void select(const MapEditOptions& options, const std::vector<std::string>& inputs, Choose choose,
            const std::function<void(TrainingImage&)>& change = {}) {
  requireOutput(options, inputs);
  const OutputLock lock(options.output);
  const auto map = openMap(options.map);
  std::vector<std::string> from{options.map};
  from.insert(from.end(), inputs.begin(), inputs.end());
  ProgressBar bar("writing");
  try {
    writeSelection(
        *map, choose(*map), provenance(options.command, from), options.output,
        [&bar](std::size_t done, std::size_t total) { bar.show(done, total); }, change);
  } catch (const MapEditError& error) {
    throw MapEditError(options.map + ": " + error.what());
  }
  std::cout << oneLine(options.map) << ": " << describe(*map) << '\n';
}

std::vector<bool> inside(const TrainingMap& map, const Region& region) {
  std::vector<bool> keep(map.size());
  for (std::size_t i = 0; i < map.size(); ++i) keep[i] = region.contains(map.frame().toGeodetic(map.position_m(i)));
  return keep;
}

/// What `read` makes of a file, which is named when it makes nothing of it.
template <class Error, class Read>
auto readWith(const std::string& path, Read read) {
  try {
    return read(readFile(path, kMostText_bytes));
  } catch (const Error& error) {
    throw Error(path + ": " + error.what());
  }
}

void cut(const MapEditOptions& options) {
  const auto region = readWith<RegionError>(
      options.polygon, [](const std::string& text) { return std::make_unique<const Region>(text); });
  select(options, {options.polygon}, [&](const TrainingMap& map) { return inside(map, *region); });
}

void summarise(const MapEditOptions& options) {
  MapUsage usage;
  for (const std::string& path : options.usage) usage.add(readWith<UsageFileError>(path, MapUsage::fromCsv));
  SummaryConfig config;
  config.images_per_place = options.images_per_place;
  select(
      options, options.usage, [&](const TrainingMap& map) { return summary(map, usage, config); },
      [&](TrainingImage& image) { dropUnusedLandmarks(image, usage, config); });
}

void editMap(const MapEditOptions& options) {
  if (options.command == "add") addBags(options);
  if (options.command == "merge") mergeFiles(options);
  if (options.command == "remove") {
    select(options, {}, [&](const TrainingMap& map) { return withoutSession(map, options.session); });
  }
  if (options.command == "cut") cut(options);
  if (options.command == "thin") {
    select(options, {}, [&](const TrainingMap& map) { return spaced(map, options.spacing_m); });
  }
  if (options.command == "summarise") summarise(options);
  printSummary(options.output);
}

}  // namespace
}  // namespace visual_localization::apps

int main(int argc, char** argv) {
  return visual_localization::apps::runProgram(argc, argv, visual_localization::apps::editMap);
}

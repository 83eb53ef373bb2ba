#include "apps/map_growth.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <utility>

#include <pwd.h>
#include <unistd.h>

#include "apps/app_support.h"
#include "apps/bag_sessions.h"
#include "base/files.h"
#include "base/text.h"
#include "editing/map_selection.h"
#include "map/map_writer.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization::apps {
namespace {

constexpr std::size_t kCache_bytes = std::size_t{512} << 20U;  ///< of all maps together

std::string user() {
  const passwd* entry = ::getpwuid(::geteuid());
  return entry == nullptr ? std::to_string(::geteuid()) : entry->pw_name;
}

std::string host() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "?";
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

/// The first one stays.
void printAllMerged(const std::vector<MergedMap>& merged) {
  std::cout << oneLine(merged.front().name) << ": " << merged.front().images << " images, stays where it is\n";
  for (std::size_t k = 1; k < merged.size(); ++k) printMerged(merged[k]);
}

/// `target`: see mergeMaps.
template <class Target>
void mergeAndPrint(const Target& target, const std::vector<NamedMap>& maps, const std::string& edit,
                   std::size_t threads) {
  std::vector<MergedMap> merged;
  {
    ProgressBar bar("aligning");
    merged =
        mergeMaps(maps, edit, target, threads, [&bar](std::size_t done, std::size_t total) { bar.show(done, total); });
  }
  printAllMerged(merged);
}

MapBuilder builderFor(const TrainingMap& map, const MapBuilderOptions& options, MapBuilderConfig& config,
                      const std::string& output) {
  config.sift = map.header().sift;
  return MapBuilder(config, {options.threads, output}, MapBase{map.header().datum, map.header().image_size});
}

/// Sessions as a map of their own.
void saveSessions(MapBuilder& builder, const MapBuilderOptions& options, const MapBuilderConfig& config,
                  const std::vector<PlottedSession>& sessions, const PartialFile& file) {
  {
    ProgressBar bar("pruning features");
    builder.save(file, [&bar](std::size_t done, std::size_t total) { bar.show(done, total); });
  }
  printReport(options, builder.report(), config.geometry, sessions);
}

/// What `file` has, as a map beside `map`; see addDrive for `usage`.
void mergeAndCull(const NamedMap& map, const std::string& name, const PartialFile& file, const MapUsage& usage,
                  const std::string& output, const std::string& edit, std::size_t threads) {
  const PartialFile merged(output);
  mergeAndPrint(merged, {map, {name, openMap(file.path(), 2)}}, edit, threads);
  const auto grown = openMap(merged.path());
  SummaryConfig where_driven;
  where_driven.unused_places = false;
  const std::vector<bool> keep = summary(*grown, usage, where_driven);
  std::cout << "left out where the drive was: " << std::count(keep.begin(), keep.end(), false) << " images\n";
  writeSelection(*grown, keep, "", output);
}

}  // namespace

std::string provenance(const std::string& program, const std::string& command, const std::vector<std::string>& from) {
  constexpr std::size_t kLongest = 4000;  // a job of a thousand maps names the first hundred
  std::vector<std::string> names;
  for (const std::string& path : from) names.push_back(std::filesystem::path(path).filename().string());
  return oneLine(command + " of " + joined(names), kLongest) + " by " + program + " " + VISUAL_LOCALIZATION_VERSION +
         ", " + oneLine(user() + "@" + host());
}

std::shared_ptr<const TrainingMap> openMap(const std::string& path, std::size_t of) {
  return loadMap(path, strictLoading(kCache_bytes / of));
}

void mergeInto(const std::string& path, const std::vector<NamedMap>& maps, const std::string& edit,
               std::size_t threads) {
  mergeAndPrint(path, maps, edit, threads);
}

void addSessions(const NamedMap& map, const MapBuilderOptions& options, const MapUsage* usage,
                 const std::string& output, const std::string& edit) {
  MapBuilderConfig config = readConfig(options);
  MapBuilder builder = builderFor(*map.map, options, config, output);
  std::vector<PlottedSession> sessions;
  for (const std::string& bag : options.bags) addSession(builder, bag, options, config, sessions);
  const PartialFile added(output);
  saveSessions(builder, options, config, sessions, added);
  const std::string name = joined(options.bags);
  if (usage != nullptr) return mergeAndCull(map, name, added, *usage, output, edit, options.threads);
  mergeAndPrint(output, {map, {name, openMap(added.path(), 2)}}, edit, options.threads);
}

void addDrive(const NamedMap& map, const VerifiedDrive& drive, const MapBuilderOptions& options, const MapUsage& usage,
              const std::string& output, const std::string& edit) {
  MapBuilderConfig config = readConfig(options);
  MapBuilder builder = builderFor(*map.map, options, config, output);
  std::vector<PlottedSession> sessions;
  addVerifiedSession(builder, options.bags.front(), drive, options, sessions);
  const PartialFile added(output);
  saveSessions(builder, options, config, sessions, added);
  mergeAndCull(map, options.bags.front(), added, usage, output, edit, options.threads);
}

}  // namespace visual_localization::apps

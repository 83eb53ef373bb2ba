#include <filesystem>
#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "apps/app_support.h"
#include "apps/bag_sessions.h"
#include "apps/command_line.h"
#include "apps/region.h"
#include "base/files.h"
#include "base/text.h"
#include "editing/map_merger.h"
#include "editing/map_selection.h"
#include "map/map_writer.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization::apps {
namespace {

const char* const kProgram = "map_edit";
constexpr std::size_t kMostText_bytes = std::size_t{256} << 20U;

/// Refuses what could only fail after the work.
void requireOutput(const MapEditOptions& options, std::vector<std::string> inputs) {
  inputs.push_back(options.map);
  inputs.insert(inputs.end(), options.maps.begin(), options.maps.end());
  requireNoInput("--output", options.output, inputs);
  const PartialFile attempt(options.output);
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

void mergeFiles(const MapEditOptions& options) {
  requireDifferent("map", options.maps);
  requireOutput(options, {});
  const OutputLock lock(options.output);
  std::vector<NamedMap> maps;
  for (const std::string& path : options.maps) maps.push_back({path, openMap(path, options.maps.size())});
  maps = inOrderOfTime(std::move(maps));
  std::vector<std::string> names;
  for (const NamedMap& map : maps) names.push_back(map.name);
  mergeInto(options.output, maps, provenance(kProgram, options.command, names), options.build.threads);
}

/// Names the file when `read` makes nothing of it.
template <class Error, class Read>
auto readWith(const std::string& path, Read read) {
  try {
    return read(readFile(path, kMostText_bytes));
  } catch (const Error& error) {
    throw Error(path + ": " + error.what());
  }
}

MapUsage usageOf(const MapEditOptions& options) {
  MapUsage usage;
  for (const std::string& path : options.usage) usage.add(readWith<UsageFileError>(path, MapUsage::fromCsv));
  return usage;
}

void addBags(const MapEditOptions& options) {
  requireDifferent("--bag", options.build.bags);
  std::vector<std::string> inputs = options.build.bags;
  inputs.insert(inputs.end(), options.usage.begin(), options.usage.end());
  inputs.insert(inputs.end(), {options.build.config, options.build.camera_info, options.build.mask});
  requireOutput(options, inputs);
  const OutputLock lock(options.output);
  const MapUsage usage = usageOf(options);
  std::vector<std::string> from{options.map};
  from.insert(from.end(), options.build.bags.begin(), options.build.bags.end());
  addSessions({options.map, openMap(options.map, 2)}, options.build, options.usage.empty() ? nullptr : &usage,
              options.output, provenance(kProgram, options.command, from));
}

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
        *map, choose(*map), provenance(kProgram, options.command, from), options.output,
        [&bar](std::size_t done, std::size_t total) { bar.show(done, total); }, change);
  } catch (const MapEditError& error) {
    throw MapEditError(options.map + ": " + error.what());
  }
  std::cout << oneLine(options.map) << ": " << describe(*map) << '\n';
}

template <class Contains>
std::vector<bool> inside(const TrainingMap& map, Contains contains) {
  std::vector<bool> keep(map.size());
  for (std::size_t i = 0; i < map.size(); ++i) keep[i] = contains(map.position_m(i));
  return keep;
}

void cutBox(const MapEditOptions& options) {
  const Eigen::AlignedBox2d box(Eigen::Vector2d(options.box_m[0], options.box_m[1]),
                                Eigen::Vector2d(options.box_m[2], options.box_m[3]));
  if (box.isEmpty()) throw UsageError("--box: must be WEST SOUTH EAST NORTH, with WEST <= EAST and SOUTH <= NORTH");
  select(options, {}, [&](const TrainingMap& map) {
    return inside(map, [&](const Eigen::Vector2d& position_m) { return box.contains(position_m); });
  });
}

void cutPolygon(const MapEditOptions& options) {
  const RegionFrame frame = options.metres ? RegionFrame::kMap : RegionFrame::kEarth;
  const auto region = readWith<RegionError>(
      options.polygon, [frame](const std::string& text) { return std::make_unique<const Region>(text, frame); });
  select(options, {options.polygon}, [&](const TrainingMap& map) {
    return inside(map, [&](const Eigen::Vector2d& position_m) { return region->contains(position_m, map.frame()); });
  });
}

void summarise(const MapEditOptions& options) {
  const MapUsage usage = usageOf(options);
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
  if (options.command == "cut") options.box_m.empty() ? cutPolygon(options) : cutBox(options);
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

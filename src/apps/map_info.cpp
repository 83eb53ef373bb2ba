#include <filesystem>
#include <iostream>
#include <limits>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "apps/app_support.h"
#include "apps/command_line.h"
#include "apps/map_export.h"
#include "apps/report_page.h"
#include "base/files.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization::apps {
namespace {

AmbiguousPlaces lookForAmbiguousPlaces(const TrainingMap& map) {
  ProgressBar bar("comparing training images");
  return findAmbiguousPlaces(map, {}, [&bar](std::size_t done, std::size_t total) { bar.show(done, total); });
}

/// All where that is asked for or they are in memory.
std::size_t mostImages(const MapInfoOptions& options) {
  constexpr std::size_t kMostOfALargeMap = 2000;
  const bool in_memory = std::filesystem::file_size(options.map) <= MapLoading().cache_bytes;
  return options.check || in_memory ? std::numeric_limits<std::size_t>::max() : kMostOfALargeMap;
}

/// Nothing without a path.
void exportFile(const std::string& path, const TrainingMap& map, const MapFindings& findings,
                decltype(writeCsv)& writeTo) {
  if (path.empty()) return;
  PartialFile file(path);
  std::string waiting;  // a call to the system for each line would take longer than the line
  constexpr std::size_t kWaiting_bytes = std::size_t{1} << 20U;
  writeTo(map, findings, [&](const std::string& text) {
    waiting += text;
    if (waiting.size() < kWaiting_bytes) return;
    file.write(waiting);
    waiting.clear();
  });
  file.write(waiting);
  file.commit();
}

std::string mapPage(const std::string& path, const TrainingMap& map, const MapFindings& findings) {
  nlohmann::json page_map = pageMap(path, map);
  addFindings(path, map, findings, page_map);
  return reportPage({{"map", std::move(page_map)}});
}

void showMap(const MapInfoOptions& options) {
  if (!options.geojson.empty()) requireNoInput("--export-geojson", options.geojson, {options.map});
  if (!options.csv.empty()) requireNoInput("--export-csv", options.csv, {options.map});
  if (!options.report.empty()) requireNoInput("--report", options.report, {options.map});
  if (options.check) checkMap(options.map);
  const auto map = loadMap(options.map);
  MapFindings findings;
  findings.config.few_features = options.few_features;
  findings.survey = survey(*map, findings.config);
  findings.landmarks = landmarkSurvey(*map, mostImages(options));
  findings.errors = expectedErrors(*map, mostImages(options));
  if (options.ambiguity) findings.ambiguity = lookForAmbiguousPlaces(*map);
  printMapReport(std::cout, options.map, *map, findings);
  if (options.check) std::cout << "\ncheck:       ok\n";
  exportFile(options.geojson, *map, findings, writeGeoJson);
  exportFile(options.csv, *map, findings, writeCsv);
  if (!options.report.empty()) writeFile(options.report, mapPage(options.map, *map, findings));
}

}  // namespace
}  // namespace visual_localization::apps

int main(int argc, char** argv) {
  return visual_localization::apps::runProgram(argc, argv, visual_localization::apps::showMap);
}

#include <iostream>
#include <string>

#include "apps/app_support.h"
#include "apps/map_export.h"
#include "apps/map_report.h"
#include "apps/progress_bar.h"
#include "base/files.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization {
namespace {

struct Options {
  std::string map;
  bool check = false;
  bool ambiguity = false;
  std::size_t few_features = SurveyConfig().few_features;
  std::string geojson;
  std::string csv;
};

AmbiguousPlaces lookForAmbiguousPlaces(const TrainingMap& map) {
  apps::ProgressBar bar("comparing places");
  return findAmbiguousPlaces(map, {}, [&bar](std::size_t done, std::size_t total) { bar.show(done, total); });
}

void showMap(const Options& options) {
  for (const std::string& output : {options.geojson, options.csv}) {
    if (!output.empty()) apps::requireNoInput("--export", output, {options.map});
  }
  if (options.check) checkMap(options.map);
  const auto map = loadMap(options.map);
  apps::MapFindings findings;
  findings.config.few_features = options.few_features;
  findings.survey = survey(*map, findings.config);
  if (options.ambiguity) findings.ambiguity = lookForAmbiguousPlaces(*map);
  apps::printMapReport(std::cout, options.map, *map, findings);
  if (options.check) std::cout << "\ncheck:       ok\n";
  if (!options.geojson.empty()) writeFile(options.geojson, apps::toGeoJson(*map, findings));
  if (!options.csv.empty()) writeFile(options.csv, apps::toCsv(*map, findings));
}

}  // namespace
}  // namespace visual_localization

int main(int argc, char** argv) {
  CLI::App app("Shows what a map holds and where it is weak, checks it and exports it.", "map_info");
  visual_localization::Options options;
  app.add_option("map", options.map, "the map file")->required();
  app.add_flag("--check", options.check, "verify every checksum and the structure of the file");
  app.add_flag("--ambiguity", options.ambiguity,
               "look for places that are taken for others; takes seconds, at most about a minute");
  app.add_option("--few-features", options.few_features, "an image with fewer SIFT features is weak")
      ->check(CLI::Range(std::size_t{0}, std::size_t{1'000'000}))
      ->capture_default_str();
  app.add_option("--export-geojson", options.geojson, "write paths, weak stretches and images as GeoJSON (WGS84)");
  app.add_option("--export-csv", options.csv, "write one line an image");
  return visual_localization::apps::runProgram(app, argc, argv, [&options] { visual_localization::showMap(options); });
}

#include "visual_localization/map/map_builder.h"

#include <chrono>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "apps/app_support.h"
#include "apps/bag_sessions.h"
#include "apps/map_export.h"
#include "apps/report_page.h"
#include "base/files.h"
#include "visual_localization/map/map_file.h"

namespace visual_localization::apps {
namespace {

/// Throws FileError when `path` cannot be created or replaced.
void requireWritable(const std::string& path) { const PartialFile attempt(path); }

/// Refuses what could only fail after the work.
void requireOutputs(const MapBuilderOptions& options) {
  std::vector<std::string> inputs = options.bags;
  inputs.insert(inputs.end(), {options.config, options.camera_info, options.mask});
  requireDifferent("--bag", options.bags);
  requireNoInput("--output", options.output, inputs);
  inputs.push_back(options.output);
  if (!options.plot.empty()) requireNoInput("--plot", options.plot, inputs);
  requireWritable(options.output);
  if (!options.plot.empty()) requireWritable(options.plot);
}

/// As map_info --report, with what became of the fixes.
std::string pageOf(const std::string& path, const TrainingMap& map, const std::vector<PlottedSession>& sessions) {
  constexpr std::size_t kMostImages = 2000;
  MapFindings findings;
  findings.survey = survey(map, findings.config);
  findings.landmarks = landmarkSurvey(map, kMostImages);
  findings.errors = expectedErrors(map, kMostImages);
  nlohmann::json page_map = pageMap(path, map);
  addFindings(path, map, findings, page_map);
  addBuild(sessions, map.frame(), page_map);
  return reportPage({{"map", std::move(page_map)}});
}

/// The map is written whatever becomes of its plot.
void draw(const MapBuilderOptions& options, std::vector<PlottedSession>& sessions, const LocalFrame& frame) {
  try {
    const auto map = loadMap(options.output);
    if (endingOf(options.plot) == ".HTML") return writeFile(options.plot, pageOf(options.output, *map, sessions));
    addMap(*map, sessions);
    drawMapPlot(options.plot, sessions, frame);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(error.what() + ("; the map is written without a plot: " + options.output));
  }
}

void buildMap(const MapBuilderOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  const MapBuilderConfig config = readConfig(options);
  requireOutputs(options);
  const OutputLock lock(options.output);
  MapBuilder builder(config, {options.threads, options.output});
  std::vector<PlottedSession> sessions;
  for (const std::string& bag : options.bags) addSession(builder, bag, options, config, sessions);
  if (config.geometry.enabled && config.geometry.self_calibration) announceCalibration(builder.report());
  {
    ProgressBar bar("pruning features");
    builder.save(options.output, [&bar](std::size_t done, std::size_t total) { bar.show(done, total); });
  }
  printReport(options, builder.report(), config.geometry, sessions);
  printSummary(options, builder.report(),
               std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  if (!options.plot.empty()) draw(options, sessions, builder.frame());
  printDisagreements(builder.report(), sessions);
}

}  // namespace
}  // namespace visual_localization::apps

int main(int argc, char** argv) {
  return visual_localization::apps::runProgram(argc, argv, visual_localization::apps::buildMap);
}

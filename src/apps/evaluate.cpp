// Repeats the papers' experiments on recordings: every method on every pair of recordings, from every start image.

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <system_error>

#include <opencv2/core/utility.hpp>

#include "apps/app_support.h"
#include "apps/command_line.h"
#include "apps/commit.h"
#include "base/files.h"
#include "base/text.h"
#include "evaluation/evaluator.h"
#include "evaluation/experiment.h"
#include "evaluation/round_recorder.h"
#include "features/vector_target.h"
#include "parameters/yaml_map.h"

namespace visual_localization::apps {
namespace {

namespace fs = std::filesystem;

std::string bagPath(const EvaluateOptions& options, const RoundSpec& round) {
  const fs::path folder = options.rounds.empty() ? fs::path(options.config).parent_path() : fs::path(options.rounds);
  return (folder / round.bag).string();
}

constexpr std::size_t kLargestBeside_bytes = std::size_t{64} << 20U;  ///< a calibration, or poses

/// FNV-1a, 64 bits.
std::string hashOf(const std::string& text) {
  std::uint64_t hash = 14695981039346656037U;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211U;
  return std::to_string(hash);
}

/// To notice that a small file was edited.
std::string fingerprintOf(const std::string& path) { return hashOf(readFile(path, kLargestBeside_bytes)); }

/// What besides the configuration decides about the results: sizes of the bags, the files beside them, this version.
std::string provenanceOf(const Experiment& experiment, const EvaluateOptions& options) {
  std::string text = std::string("what,value\npackage_version,") + VISUAL_LOCALIZATION_VERSION + "\nunit_format," +
                     std::to_string(kUnitFormat) + "\npreset," + experiment.front_end.preset + "\n";
  for (const RoundSpec& round : experiment.rounds) {
    std::error_code error;
    const auto size = fs::file_size(bagPath(options, round), error);
    if (error)
      throw BagError(bagPath(options, round) + ": recording " + round.name + " cannot be read: " + error.message());
    text += csvField("bytes of " + round.name) + "," + std::to_string(size) + "\n";
    for (const std::string& file : {round.camera_info, round.poses}) {
      if (file.empty()) continue;
      text +=
          csvField(file + " of " + round.name) + "," + fingerprintOf(besideBag(bagPath(options, round), file)) + "\n";
    }
  }
  return text;
}

std::string processorName() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(std::min(line.size(), line.find(':') + 2));
  }
  return "unknown";
}

/// Every parameter of every method.
std::string configurationOf(const Experiment& experiment) {
  std::string text;
  const auto add = [&text](const ParameterValues& values) {
    for (const auto& [name, value] : values) text += name + "=" + parameters::toString(value) + "\n";
  };
  add(valuesOf(experiment.map));
  for (const MethodSpec& method : experiment.methods) add(valuesOf(method.localizer));
  return text;
}

/// Where the results come from, for people: what decides about them is in provenance.csv.
void writeOrigin(const Experiment& experiment, const EvaluateOptions& options) {
  const std::time_t now = std::time(nullptr);
  std::array<char, 32> date{};
  std::strftime(date.data(), date.size(), "%Y-%m-%d", std::gmtime(&now));
  writeFile(options.output + "/origin.csv", std::string("what,value\ncommit,") + kCommit + "\ndate," + date.data() +
                                                "\nprocessor," + csvField(processorName()) + "\nvector_target," +
                                                vectorTarget() + "\nconfiguration," +
                                                hashOf(configurationOf(experiment)) + "\n");
}

/// One bar for each stage of the work.
class StageBars {
 public:
  void show(const std::string& stage, std::size_t done, std::size_t total) {
    if (!bar_ || stage != stage_) bar_ = std::make_unique<ProgressBar>(stage);
    stage_ = stage;
    bar_->show(done, total);
  }

 private:
  std::string stage_;
  std::unique_ptr<ProgressBar> bar_;
};

void runExperiment(const Experiment& experiment, const ResultFolder& results, const EvaluateOptions& options) {
  const RoundSource source{
      [&](const RoundSpec& round) { return recordMap(bagPath(options, round), round, experiment.map); },
      [&](const RoundSpec& round) {
        return recordDrive(bagPath(options, round), round, experiment.map, experiment.front_end,
                           experiment.solvesPoses());
      },
      [&](const RoundSpec& round, const TrainingMap& map) {
        return trueMapPoses(bagPath(options, round), round, experiment.map, map);
      }};
  cv::setNumThreads(1);  // the threads are spread over recordings and runs
  StageBars bars;
  evaluate(experiment, source, results, options.shard.value_or(Shard{}), options.threads,
           [&bars](const std::string& stage, std::size_t done, std::size_t total) { bars.show(stage, done, total); });
}

void mergeFolders(const Experiment& experiment, const ResultFolder& results, const EvaluateOptions& options,
                  const std::string& yaml, const std::string& provenance) {
  for (const std::string& folder : options.merge) {
    const std::size_t copied = mergeResults(ResultFolder::open(folder, yaml, provenance), results, experiment);
    std::printf("%s: %zu results\n", oneLine(folder).c_str(), copied);
  }
}

/// The tables are written whatever becomes of their report.
void report(const std::string& folder) {
  const std::string script = "report_evaluation.py";
  try {
    runScript(script, {folder});
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(error.what() + ("; the tables are written, draw them with: " + script + " -- " + folder));
  }
}

void run(const EvaluateOptions& options) {
  const std::string yaml = readFile(options.config, parameters::kLargestYaml_bytes);  // once: it may be a pipe
  const Experiment experiment = parseExperiment(yaml, options.config, options.preset);
  const std::string provenance = provenanceOf(experiment, options);
  const ResultFolder results(options.output, yaml, provenance);
  mergeFolders(experiment, results, options, yaml, provenance);
  if (options.merge.empty()) runExperiment(experiment, results, options);
  if (options.shard) {
    std::printf("shard %zu/%zu of %s is done; when all are: evaluate --config %s --output %s --merge FOLDER ...\n",
                options.shard->index, options.shard->count, experiment.name.c_str(), options.config.c_str(),
                options.output.c_str());
    return;
  }
  writeResultTables(experiment, results);
  writeOrigin(experiment, options);
  if (!options.no_report) report(options.output);
  std::printf("%s: %zu pairs, %zu methods, results in %s\n", experiment.name.c_str(), experiment.pairs.size(),
              experiment.methods.size(), options.output.c_str());
}

}  // namespace
}  // namespace visual_localization::apps

int main(int argc, char** argv) {
  return visual_localization::apps::runProgram(argc, argv, visual_localization::apps::run);
}

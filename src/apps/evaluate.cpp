// Repeats the papers' experiments on recorded rounds: every method on every pair of rounds, from every start image.

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <opencv2/core/utility.hpp>

#include "apps/app_support.h"
#include "apps/evaluation_report.h"
#include "apps/progress_bar.h"
#include "base/files.h"
#include "evaluation/evaluator.h"
#include "evaluation/experiment.h"
#include "evaluation/result_folder.h"
#include "evaluation/round_recorder.h"

namespace visual_localization::apps {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::string config;
  std::string rounds;
  std::string output;
  std::optional<std::string> shard;
  std::vector<std::string> merge;
  std::optional<std::string> threads;
  bool no_report = false;
};

void declareOptions(CLI::App& app, Options& options) {
  app.add_option("--config", options.config, "Experiment, YAML (see config/evaluation)")->required();
  app.add_option("--rounds", options.rounds, "Folder of the bags; default: the one of the YAML file");
  app.add_option("--output", options.output, "Folder for results, report and figures; work found there is not repeated")
      ->required();
  app.add_option("--threads", options.threads, "Threads to use, from 1 to 1024; default: all cores");
  auto* shard = app.add_option("--shard", options.shard, "I/N: run only part I of N of the pairs, without a report");
  app.add_option("--merge", options.merge, "Take the results of shards from these folders, run nothing, and report")
      ->excludes(shard);
  app.add_flag("--no-report", options.no_report, "Write the tables only: neither report nor figures");
}

/// The number that `text` is made of, no sign or space beside it; 0 for anything else.
std::size_t numberOf(const std::string& text) {
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() ? number : 0;
}

Shard shardOf(const Options& options) {
  if (!options.shard) return {};
  const std::string& text = *options.shard;
  const std::size_t slash = std::min(text.find('/'), text.size());
  const Shard shard{numberOf(text.substr(0, slash)), numberOf(text.substr(std::min(slash + 1, text.size())))};
  if (shard.index == 0 || shard.count == 0 || shard.index > shard.count) {
    throw UsageError("--shard '" + text + "' is not allowed: must be I/N with I from 1 to N");
  }
  return shard;
}

std::size_t threadsOf(const Options& options) {
  constexpr std::size_t kMost = 1024;
  if (!options.threads) return std::max<std::size_t>(1, std::thread::hardware_concurrency());
  const std::size_t threads = numberOf(*options.threads);
  if (threads == 0 || threads > kMost) {
    throw UsageError("--threads '" + *options.threads + "' is not allowed: must be an integer in [1, 1024]");
  }
  return threads;
}

std::string bagPath(const Options& options, const RoundSpec& round) {
  const fs::path folder = options.rounds.empty() ? fs::path(options.config).parent_path() : fs::path(options.rounds);
  return (folder / round.bag).string();
}

/// What besides the configuration decides about the results: the bags, by their sizes, and this version.
std::string provenanceOf(const Experiment& experiment, const Options& options) {
  std::string text = std::string("what,value\npackage_version,") + VISUAL_LOCALIZATION_VERSION + "\n";
  for (const RoundSpec& round : experiment.rounds) {
    std::error_code error;
    const auto size = fs::file_size(bagPath(options, round), error);
    if (error)
      throw BagError(bagPath(options, round) + ": round " + round.name + " cannot be read: " + error.message());
    text += "bytes of " + round.name + "," + std::to_string(size) + "\n";
  }
  return text;
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

void runExperiment(const Experiment& experiment, const ResultFolder& results, const Options& options) {
  const RoundSource source{
      [&](const RoundSpec& round) { return recordMap(bagPath(options, round), round, experiment.map); },
      [&](const RoundSpec& round) {
        return recordDrive(bagPath(options, round), round, experiment.map, experiment.front_end);
      }};
  cv::setNumThreads(1);  // the threads are spread over rounds and runs
  StageBars bars;
  evaluate(experiment, source, results, shardOf(options), threadsOf(options),
           [&bars](const std::string& stage, std::size_t done, std::size_t total) { bars.show(stage, done, total); });
}

void mergeFolders(const Experiment& experiment, const ResultFolder& results, const Options& options,
                  const std::string& yaml, const std::string& provenance) {
  for (const std::string& folder : options.merge) {
    if (!fs::is_directory(folder)) throw UsageError("--merge " + folder + " is not a folder");
    const std::size_t copied = mergeResults(ResultFolder::open(folder, yaml, provenance), results, experiment);
    std::printf("%s: %zu results\n", folder.c_str(), copied);
  }
}

void run(const Options& options) {
  shardOf(options);  // mistakes on the command line before all others
  threadsOf(options);
  if (options.output.empty()) throw UsageError("--output must name a folder");
  const std::string yaml = readFile(options.config);  // once: it may be a pipe
  const Experiment experiment = parseExperiment(yaml, options.config);
  const std::string provenance = provenanceOf(experiment, options);
  const ResultFolder results(options.output, yaml, provenance);
  mergeFolders(experiment, results, options, yaml, provenance);
  if (options.merge.empty()) runExperiment(experiment, results, options);
  if (options.shard) {
    std::printf("shard %s of %s is done; when all are: evaluate --config %s --output %s --merge FOLDER ...\n",
                options.shard->c_str(), experiment.name.c_str(), options.config.c_str(), options.output.c_str());
    return;
  }
  writeResultTables(experiment, results);
  if (!options.no_report) drawReport(options.output);
  std::printf("%s: %zu pairs, %zu methods, results in %s\n", experiment.name.c_str(), experiment.pairs.size(),
              experiment.methods.size(), options.output.c_str());
}

}  // namespace
}  // namespace visual_localization::apps

int main(int argc, char** argv) {
  using namespace visual_localization::apps;
  CLI::App app("Runs an experiment of the papers on recorded rounds; writes tables, a report and figures.", "evaluate");
  Options options;
  declareOptions(app, options);
  return runProgram(app, argc, argv, [&options] { run(options); });
}

#include "apps/command_line.h"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iostream>
#include <new>
#include <stdexcept>
#include <system_error>
#include <thread>

#include <CLI/CLI.hpp>
#include <unistd.h>

#include "apps/app_support.h"
#include "base/files.h"
#include "base/text.h"
#include "features/vector_target.h"

namespace visual_localization::apps {
namespace {

constexpr int kSuccess = 0;
constexpr int kFailedRun = 1;
constexpr int kBadUsage = 2;

constexpr std::size_t kMostThreads = 1024;
constexpr int kMostMaps = 100'000;
constexpr double kLeastSpacing_m = 0.01;
constexpr double kMostSpacing_m = 1000.0;

/// Nothing for anything but "I/N".
std::optional<Shard> shardOf(const std::string& text) {
  Shard shard;
  const char* const end = text.data() + text.size();
  const auto index = std::from_chars(text.data(), end, shard.index);
  if (index.ec != std::errc() || index.ptr == end || *index.ptr != '/') return std::nullopt;
  const auto count = std::from_chars(index.ptr + 1, end, shard.count);
  const bool possible = shard.index >= 1 && shard.index <= shard.count;
  return count.ec == std::errc() && count.ptr == end && possible ? std::optional<Shard>(shard) : std::nullopt;
}

bool isHtml(const std::string& path) { return endingOf(path) == ".HTML"; }

/// For plot_map.py, or a page.
bool isPicture(const std::string& path) {
  const std::string ending = endingOf(path);
  return ending == ".PNG" || ending == ".SVG" || ending == ".PDF" || isHtml(path);
}

CLI::Validator must(bool (*allowed)(const std::string&), const std::string& requirement) {
  const auto check = [allowed, requirement](const std::string& value) {
    return allowed(value) ? std::string() : "'" + oneLine(value) + "' is not allowed: must " + requirement;
  };
  return CLI::Validator(check, "");
}

/// CLI11 reads -1 as a huge index.
bool isNotNegative(const std::string& text) { return text.rfind('-', 0) != 0; }

template <class Options>
void declareCamera(CLI::App& app, Options& options, const std::string& otherwise) {
  app.add_option("--camera-info", options.camera_info,
                 "Calibration, YAML or INI of camera_calibration; otherwise " + otherwise);
  app.add_option("--mask", options.mask, "Grey PNG of the camera's size: features are used where it is white");
}

template <class Options>
void declarePreset(CLI::App& app, Options& options) {
  app.add_option(
      "--preset", options.preset,
      "'paper': the papers' text, 'paper_program': the authors' toolkit (parameter 'preset', config/paper.yaml "
      "and paper_program.yaml)");
}

void declareRecordings(CLI::App& app, MapBuilderOptions& options) {
  app.add_option("--bag", options.bags, "Recording; repeat it for more sessions in one map")
      ->required()
      ->take_all()
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  app.add_option("--image-topic", options.image_topic, "Raw or compressed images; finds \"/compressed\" itself")
      ->capture_default_str();
  app.add_option("--fix-topic", options.fix_topic, "sensor_msgs/NavSatFix")->capture_default_str();
  declareCamera(app, options, "the camera_info beside the image topic");
  app.add_option("--config", options.config, "Parameters, YAML (see config/map_builder.yaml)");
  app.add_option("--model", options.model,
                 "ONNX file: learned features instead of SIFT (parameters 'map/features', 'map/model')");
  app.add_option("--min-spacing", options.min_spacing_m,
                 "Metres between training images of a session, before the adjustment (parameter 'map/min_spacing')");
  app.add_option("--spacing", options.spacing_m,
                 "Metres between training images that are kept after the adjustment (parameters 'map/spacing', "
                 "'geometry/spacing')");
}

void declareThreads(CLI::App& app, std::size_t& threads) {
  app.add_option("--threads", threads, "Threads to use; the map does not depend on it")
      ->check(CLI::Range(std::size_t{1}, kMostThreads))
      ->capture_default_str();
}

void declareOptions(CLI::App& app, MapBuilderOptions& options) {
  declareRecordings(app, options);
  declarePreset(app, options);
  app.add_option("--output", options.output, "Map file to write")->required();
  declareThreads(app, options.threads);
  app.add_flag("--self-calibrate", options.self_calibrate,
               "Without a calibration find the focal length by the images (parameter 'geometry/self_calibration')");
  app.add_option("--plot", options.plot,
                 "Draw fixes, path and landmarks of each session into this PNG, SVG, PDF or HTML page, by the ending")
      ->check(must(isPicture, "end in .png, .svg, .pdf or .html"));
}

CLI::App& declareCommand(CLI::App& app, MapEditOptions& options, const char* name, const char* what) {
  CLI::App& command = *app.add_subcommand(name, what);
  command.callback([&options, name] { options.command = name; });
  command.add_option("--output", options.output, "Map file to write")->required();
  return command;
}

CLI::Option* declareUsage(CLI::App& command, MapEditOptions& options, const char* what) {
  return command.add_option("--usage", options.usage, what)
      ->take_all()
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

void declareCut(CLI::App& command, MapEditOptions& options) {
  CLI::Option_group& area = *command.add_option_group("area");
  auto* polygon = area.add_option("--polygon", options.polygon, "GeoJSON file with a Polygon or several");
  area.add_option("--box", options.box_m, "WEST SOUTH EAST NORTH in metres of the map's frame, as map_info shows them")
      ->expected(4);
  area.require_option(1);
  command.add_flag("--metres", options.metres, "The polygon is [east, north] in metres of the map's frame")
      ->needs(polygon);
}

void declareOptions(CLI::App& app, MapEditOptions& options) {
  app.require_subcommand(1);
  const auto declare = [&](const char* name, const char* what) -> CLI::App& {
    CLI::App& command = declareCommand(app, options, name, what);
    command.add_option("--map", options.map, "Map file; it stays as it is")->required();
    return command;
  };
  CLI::App& add = declare("add", "Adds recordings to a map, without those that it was made of");
  declareRecordings(add, options.build);
  declareThreads(add, options.build.threads);
  declareUsage(add, options, "Leave out what these drives used least, where they were, as summarise does");
  CLI::App& merge = declareCommand(app, options, "merge", "Makes one map of several; the oldest one stays in place");
  merge.add_option("maps", options.maps, "Map files; they stay as they are")->required()->expected(2, kMostMaps);
  declareThreads(merge, options.build.threads);
  declare("remove", "Leaves out a session").add_option("--session", options.session, "Its name")->required();
  declareCut(declare("cut", "Keeps what is inside polygons or a box"), options);
  declare("thin", "Leaves out images that are close to the one before")
      .add_option("--spacing", options.spacing_m, "Metres between images of a session")
      ->required()
      ->check(CLI::Range(kLeastSpacing_m, kMostSpacing_m));
  CLI::App& summarise = declare("summarise", "Keeps what drives used, and one image of each session at each place");
  declareUsage(summarise, options, "What a drive used (localize --usage); repeat it for more drives")->required();
  summarise.add_option("--per-place", options.images_per_place, "Images that stay within 5 m, all sessions together")
      ->check(CLI::Range(std::size_t{1}, std::size_t{1000}))
      ->capture_default_str();
}

void declareOptions(CLI::App& app, MapInfoOptions& options) {
  app.add_option("map", options.map, "Map file")->required();
  app.add_flag("--check", options.check, "Verify every checksum and the structure of the file");
  app.add_flag("--ambiguity", options.ambiguity,
               "Find training images that look like others far away; takes seconds, at most about a minute");
  app.add_option("--few-features", options.few_features, "An image with fewer SIFT features is weak")
      ->check(CLI::Range(std::size_t{0}, std::size_t{1'000'000}))
      ->capture_default_str();
  app.add_option("--export-geojson", options.geojson, "Write paths, weak stretches and images as GeoJSON (WGS84)");
  app.add_option("--export-csv", options.csv, "Write one line per image");
  app.add_option("--report", options.report, "Write a page to look at the map in a browser, HTML")
      ->check(must(isHtml, "end in .html"));
}

void declareOptions(CLI::App& app, LocalizeOptions& options) {
  app.add_option("--map", options.map, "Map file")->required();
  app.add_option("--bag", options.bag, "Recording of the drive")->required();
  app.add_option("--output", options.output, "Track to write, CSV")->required();
  app.add_option("--config", options.config, "Parameters, YAML (see config/localizer.yaml)");
  declarePreset(app, options);
  app.add_option("--tracker", options.tracker, "Tracker (parameter 'tracker')");
  app.add_option("--features", options.features, "Features (parameter 'features')");
  app.add_option("--model", options.model, "ONNX file of learned features (parameter 'model')");
  app.add_option("--match", options.match, "How local features are matched (parameter 'match/mode')");
  app.add_option("--pose-source", options.pose_source, "'metric' or 'place' (parameter 'pose_source')");
  app.add_option("--particles", options.particles, "Number of particles of the tracker");
  app.add_option("--seed", options.seed, "Seed of the random generator (parameter 'seed')");
  app.add_option("--map-cache-mb", options.map_cache_mb,
                 "Features of a larger map are read when needed (parameter 'map_cache_mb')");
  app.add_option("--start-index", options.start_index, "First image; the drive is a closed loop, indices wrap")
      ->check(must(isNotNegative, "not be negative"))
      ->capture_default_str();
  auto* at = app.add_option("--kidnap-at", options.kidnap_at, "After this number of images jump ...")
                 ->check(must(isNotNegative, "not be negative"));
  auto* to = app.add_option("--kidnap-to", options.kidnap_to, "... to this image of the drive")
                 ->check(must(isNotNegative, "not be negative"));
  at->needs(to);
  to->needs(at);
  app.add_option("--image-topic", options.image_topic, "Raw or compressed images; finds \"/compressed\" itself")
      ->capture_default_str();
  declareCamera(app, options, "the camera_info beside the image topic, or the map's");
  app.add_option("--truth-topic", options.truth_topic, "NavSatFix with true positions: prints the error");
  app.add_option("--odom-topic", options.odom_topic, "nav_msgs/Odometry: bridges images that show nothing known");
  app.add_option("--extend", options.extend,
                 "Write the map with this drive as a new session, by its verified poses: it needs no fixes");
  app.add_option("--usage", options.usage, "Write which training images and landmarks the poses rest on, CSV");
  app.add_option("--report", options.report, "Write a page to look at the drive and the map in a browser, HTML")
      ->check(must(isHtml, "end in .html"));
}

void declareOptions(CLI::App& app, EvaluateOptions& options) {
  app.add_option("--config", options.config, "Experiment, YAML (see config/evaluation)")->required();
  declarePreset(app, options);
  app.add_option("--rounds", options.rounds, "Folder of the bags; default: the one of the YAML file");
  app.add_option("--output", options.output, "Folder for results, report and figures; work found there is not repeated")
      ->required()
      ->check(must([](const std::string& path) { return !path.empty(); }, "name a folder"));
  app.add_option("--threads", options.threads, "Threads to use")
      ->check(CLI::Range(std::size_t{1}, kMostThreads))
      ->capture_default_str();
  const auto set_shard = [&options](const std::string& text) { options.shard = shardOf(text); };
  auto* shard =
      app.add_option_function<std::string>("--shard", set_shard,
                                           "I/N: run only part I of N of the pairs, without a report")
          ->check(must([](const std::string& text) { return shardOf(text).has_value(); }, "be I/N with I from 1 to N"));
  app.add_option("--merge", options.merge, "Report the results of shards in these folders, run nothing")
      ->check(CLI::ExistingDirectory)
      ->excludes(shard);
  app.add_flag("--no-report", options.no_report, "Write only the tables");
}

int fail(const CLI::App& app, const std::string& reason, int code) {
  std::cout.flush();
  warn(app.get_name() + ": " + reason);
  return code;
}

/// roslaunch appends "__name:=..." and "__log:=..." to every command line.
std::vector<const char*> withoutRosNames(int argc, char** argv) {
  std::vector<const char*> arguments(argv, argv + argc);
  const auto is_ros_name = [](const char* argument) {
    const std::string text = argument;
    return text.rfind("__", 0) == 0 && text.find(":=") != std::string::npos;
  };
  arguments.erase(std::remove_if(arguments.begin(), arguments.end(), is_ros_name), arguments.end());
  return arguments;
}

template <class Options>
int runBody(const CLI::App& app, void (*body)(const Options&), const Options& options) {
  try {
    body(options);
    std::cout.flush();
    return std::cout ? kSuccess : fail(app, "standard output cannot be written", kFailedRun);
  } catch (const UsageError& error) {
    return fail(app, std::string(error.what()) + " (see --help)", kBadUsage);
  } catch (const std::bad_alloc&) {
    return fail(app, "out of memory", kFailedRun);
  } catch (const std::exception& error) {
    return fail(app, error.what(), kFailedRun);
  }
}

/// Also to a thread of a library, or to what would report it.
[[noreturn]] void endWithoutMemory() {
  constexpr char kWords[] = "out of memory\n";
  const bool refused = std::current_exception() != nullptr;
  if (refused && ::write(STDERR_FILENO, kWords, sizeof kWords - 1) < 0) ::_exit(kFailedRun);
  refused ? ::_exit(kFailedRun) : std::abort();
}

/// At once: a thread of a library that waits for memory (OpenBLAS) would hold the end up for ever.
int ended(int code) {
  std::cout.flush();
  std::cerr.flush();
  std::fflush(nullptr);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  ::_exit(code);
#else
  return code;
#endif
}

template <class Options>
int run(CLI::App& app, int argc, char** argv, void (*body)(const Options&)) {
  std::set_terminate(endWithoutMemory);
  Options options;
  declareOptions(app, options);
  try {
    app.set_version_flag("--version", app.get_name() + " " + VISUAL_LOCALIZATION_VERSION + " (" + vectorTarget() + ")");
    const auto arguments = withoutRosNames(argc, argv);
    app.parse(static_cast<int>(arguments.size()), arguments.data());
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    return fail(app, std::string(error.what()) + " (see --help)", kBadUsage);
  } catch (const std::invalid_argument& error) {
    return fail(app, error.what(), kBadUsage);
  }
  removePartialFilesOnSignals();
  return ended(runBody(app, body, options));
}

}  // namespace

std::size_t allCores() { return std::max(1U, std::thread::hardware_concurrency()); }

int runProgram(int argc, char** argv, void (*body)(const MapBuilderOptions& options)) {
  CLI::App app("Builds a map from recordings: images and DGPS fixes in, training images with positions out.",
               "map_builder");
  return run(app, argc, argv, body);
}

int runProgram(int argc, char** argv, void (*body)(const MapEditOptions& options)) {
  CLI::App app("Makes a map of others: adds, merges, removes, cuts, thins and summarises.", "map_edit");
  return run(app, argc, argv, body);
}

int runProgram(int argc, char** argv, void (*body)(const MapInfoOptions& options)) {
  CLI::App app("Shows what a map covers and where it is weak, checks it and exports it.", "map_info");
  return run(app, argc, argv, body);
}

int runProgram(int argc, char** argv, void (*body)(const LocalizeOptions& options)) {
  CLI::App app("Localises a recorded drive against a map and writes the track as CSV.", "localize");
  return run(app, argc, argv, body);
}

int runProgram(int argc, char** argv, void (*body)(const EvaluateOptions& options)) {
  CLI::App app("Runs an experiment of the papers on recordings; writes tables, a report and figures.", "evaluate");
  return run(app, argc, argv, body);
}

}  // namespace visual_localization::apps

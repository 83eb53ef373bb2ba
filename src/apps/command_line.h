#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/evaluator.h"
#include "survey/map_survey.h"

/// CLI11, which takes seconds to compile, is included by command_line.cpp alone.
namespace visual_localization::apps {

/// At least 1.
std::size_t allCores();

struct MapBuilderOptions {
  std::vector<std::string> bags;
  std::string image_topic = "/stereo/left/image_raw";
  std::string fix_topic = "/gps/fix";
  std::string output;
  std::string config;
  std::string plot;
  std::string camera_info;
  std::string mask;
  std::optional<double> min_spacing_m;
  std::optional<double> spacing_m;
  std::size_t threads = allCores();
  std::string model;
  bool self_calibrate = false;
  std::string preset;
};

struct MapEditOptions {
  std::string command;  ///< "add", "merge", "remove", "cut", "thin" or "summarise"
  std::string map;
  std::vector<std::string> maps;  ///< of "merge"
  std::string output;
  MapBuilderOptions build;  ///< of "add"; its threads are of "merge", too
  std::string session;
  std::string polygon;
  bool metres = false;        ///< the polygon is in the map's frame
  std::vector<double> box_m;  ///< west, south, east, north; empty: a polygon
  double spacing_m = 0.0;
  std::vector<std::string> usage;
  std::size_t images_per_place = 4;
};

struct MapInfoOptions {
  std::string map;
  bool check = false;
  bool ambiguity = false;
  std::size_t few_features = SurveyConfig().few_features;
  std::string geojson;
  std::string csv;
  std::string report;
};

struct LocalizeOptions {
  std::string map;
  std::string bag;
  std::string output;
  std::string config;
  std::string preset;
  std::string tracker;
  std::string features;
  std::string match;
  std::string model;
  std::string pose_source;
  std::string image_topic = "/stereo/left/image_raw";
  std::string truth_topic;
  std::string camera_info;
  std::string mask;
  std::string usage;
  std::string extend;
  std::string odom_topic;
  std::string report;
  std::optional<std::int64_t> particles;
  std::optional<std::int64_t> seed;
  std::optional<std::int64_t> map_cache_mb;
  std::size_t start_index = 0;
  std::optional<std::size_t> kidnap_at;
  std::optional<std::size_t> kidnap_to;
};

struct EvaluateOptions {
  std::string config;
  std::string preset;
  std::string rounds;
  std::string output;
  std::optional<Shard> shard;
  std::vector<std::string> merge;
  std::size_t threads = allCores();
  bool no_report = false;
};

/// Reads the command line, runs `body` and returns the exit code: 0, 1 after a failed run, 2 for bad usage. Whatever
/// goes wrong becomes one line on standard error. Unfinished output disappears, also when interrupted.
int runProgram(int argc, char** argv, void (*body)(const MapBuilderOptions& options));
int runProgram(int argc, char** argv, void (*body)(const MapEditOptions& options));
int runProgram(int argc, char** argv, void (*body)(const MapInfoOptions& options));
int runProgram(int argc, char** argv, void (*body)(const LocalizeOptions& options));
int runProgram(int argc, char** argv, void (*body)(const EvaluateOptions& options));

}  // namespace visual_localization::apps

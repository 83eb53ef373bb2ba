#include "node/node_config.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "base/text.h"
#include "visual_localization/map/map_builder.h"
#include "visual_localization/map/map_file.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

constexpr bool kAtStartOnly = true;
constexpr int kLargestMapCache_mb = 1 << 20;  ///< a tebibyte

/// tf2 knows no leading slash, and an empty name is no frame.
void requireFrame(ParameterVisitor& visitor, const std::string& name, const std::string& frame) {
  visitor.require(!frame.empty() && frame.front() != '/' && frame.find_first_of(" \t\n") == std::string::npos, name,
                  "'" + frame + "'", "a frame name without leading slash or space");
}

const char* const kIntroduction =
    "# Parameters\n\n"
    "Made from the code by `localizer_node --parameters`; a test keeps this page and the code the same.\n\n"
    "## Localizer\n"
    "In the node's private namespace, in `config/localizer.yaml` and behind `localize --config`. What says yes under\n"
    "*while running* can be changed with `rosrun dynamic_reconfigure dynparam` or rqt_reconfigure between two images; "
    "the\n"
    "track goes on. The rest is read when the node starts. A unit of 1 is a pure number.\n\n";

const char* const kMapBuilder =
    "\n## Map builder\n"
    "In `config/map_builder.yaml`, behind `map_builder --config`. The map keeps what live images must be treated "
    "with.\n\n";

template <class Config>
std::string tableOf(bool with_run_time) {
  Config defaults;
  return parameters::markdownTable([&defaults](ParameterVisitor& visitor) { defaults.declare(visitor); },
                                   with_run_time);
}

namespace fs = std::filesystem;

bool isBelow(const fs::path& directory, const fs::path& file) {
  const auto [in_directory, in_file] = std::mismatch(directory.begin(), directory.end(), file.begin(), file.end());
  return in_directory == directory.end() && in_file != file.end();
}

}  // namespace

void NodeConfig::declare(ParameterVisitor& visitor) {
  visitor.text({"map", "", "path of the map file; empty: none until ~load_map is called", kAtStartOnly}, map);
  visitor.integer(
      {"map_cache_mb", "MiB", "features of a larger map are read when needed and kept up to this", kAtStartOnly},
      map_cache_mb, 0, kLargestMapCache_mb);
  visitor.text({"map_directory", "",
                "only maps below this folder may be opened, and relative paths begin there; empty: all", kAtStartOnly},
               map_directory);
  visitor.text(
      {"image_transport", "", "raw, compressed (decoded here) or another installed image transport", kAtStartOnly},
      image_transport);
  visitor.choice({"tf_mode", "", "which transform is broadcast; map_to_odom needs odometry on tf", kAtStartOnly},
                 tf_mode, {"none", "map_to_odom", "map_to_base"});
  visitor.real({"transform_tolerance", "s", "transforms are dated so far after the image"}, transform_tolerance_s, 0.0,
               60.0);
  visitor.real({"image_timeout", "s",
                "without an image for so long diagnostics show an error and the state is no longer TRACKING"},
               image_timeout_s, 0.1, 3600.0);
  visitor.text({"global_frame_id", "", "frame of the map", kAtStartOnly}, global_frame_id);
  visitor.text({"odom_frame_id", "", "frame of the odometry", kAtStartOnly}, odom_frame_id);
  visitor.text({"base_frame_id", "", "frame of the robot", kAtStartOnly}, base_frame_id);
  requireFrame(visitor, "global_frame_id", global_frame_id);
  requireFrame(visitor, "odom_frame_id", odom_frame_id);
  requireFrame(visitor, "base_frame_id", base_frame_id);
  visitor.require(map_directory.empty() || map_directory.front() == '/', "map_directory", "'" + map_directory + "'",
                  "an absolute path");
  visitor.require(global_frame_id != base_frame_id && global_frame_id != odom_frame_id, "global_frame_id",
                  "'" + global_frame_id + "'", "another one than odom_frame_id and base_frame_id");
}

MapLoading NodeConfig::mapLoading(std::function<void(const std::string&)> warn) const {
  return {static_cast<std::size_t>(map_cache_mb) << 20U, std::move(warn)};
}

void NodeParameters::declare(ParameterVisitor& visitor) {
  node.declare(visitor);
  localizer.declare(visitor);
}

std::string localizerYaml() {
  NodeParameters defaults;
  return "# All parameters of the localizer with their defaults: unit and range, then the meaning. Made from the code "
         "by\n"
         "# `localizer_node --localizer-config`. Loaded into the private namespace of the node. A parameter that is\n"
         "# unknown or out of range stops the start.\n\n" +
         parameters::yamlFile([&defaults](ParameterVisitor& visitor) { defaults.declare(visitor); });
}

std::string mapBuilderYaml() {
  MapBuilderConfig defaults;
  return "# All parameters of the map builder with their defaults: unit and range, then the meaning. Made from the "
         "code by\n"
         "# `localizer_node --map-builder-config`; for `map_builder --config`.\n\n" +
         parameters::yamlFile([&defaults](ParameterVisitor& visitor) { defaults.declare(visitor); });
}

std::string parametersPage() {
  return kIntroduction + tableOf<NodeParameters>(true) + kMapBuilder + tableOf<MapBuilderConfig>(false);
}

std::string mapFileBelow(const std::string& directory, const std::string& path) {
  if (directory.empty()) return path;
  const auto refuse = [&path](const std::string& reason) -> std::string {
    throw MapStoreError(oneLine(path) + ": " + oneLine(reason));
  };
  // The system would read the name only up to a zero.
  if (path.empty() || path.find('\0') != std::string::npos) return refuse("is not the name of a file");
  try {
    const fs::path top = fs::canonical(directory);
    const fs::path file = fs::weakly_canonical(top / path);
    return isBelow(top, file) ? file.string() : refuse("is not below ~map_directory '" + directory + "'");
  } catch (const fs::filesystem_error& error) {
    return refuse("cannot be found below ~map_directory '" + directory + "': " + error.code().message());
  }
}

}  // namespace visual_localization

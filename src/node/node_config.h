#pragma once

#include <functional>
#include <string>
#include <vector>

#include "visual_localization/localization/localizer_config.h"
#include "visual_localization/map/map_file.h"
#include "visual_localization/parameters/parameter_visitor.h"

namespace visual_localization {

/// What only the ROS node needs to know.
struct NodeConfig {
  std::string map;                         ///< path of the map file; empty: wait for ~load_map
  int map_cache_mb = kDefaultMapCache_mb;  ///< features of a larger map are read when needed and kept up to this
  std::string map_directory;               ///< only maps below this folder may be opened; empty: all
  std::string image_transport = "raw";     ///< raw, compressed (decoded here), or another installed transport
  std::string tf_mode = "none";            ///< none, map_to_odom, map_to_base
  double transform_tolerance_s = 0.1;      ///< how far transforms are dated into the future
  double image_timeout_s = 5.0;            ///< without an image for so long it is an error
  std::string global_frame_id = "map";
  std::string odom_frame_id = "odom";
  std::string base_frame_id = "base_link";

  void declare(ParameterVisitor& visitor);
  /// How ~map and the maps after it are opened; `warn` hears of features that cannot be read.
  MapLoading mapLoading(std::function<void(const std::string&)> warn) const;
};

/// Everything in the private namespace of the node.
struct NodeParameters {
  NodeConfig node;
  LocalizerConfig localizer;

  void declare(ParameterVisitor& visitor);
};

/// doc/parameters.md: every parameter of the localizer and of the map builder, made from their declarations.
std::string parametersPage();
/// config/localizer.yaml and config/map_builder.yaml, made from the same declarations.
std::string localizerYaml();
std::string mapBuilderYaml();

/// The map file that `path` names when only maps below `directory` may be opened: a relative path begins there, and
/// symbolic links and ".." are followed. Without a directory, the path as it is. Throws MapStoreError, in one line that
/// begins with the path, for a file that lies elsewhere.
std::string mapFileBelow(const std::string& directory, const std::string& path);

}  // namespace visual_localization

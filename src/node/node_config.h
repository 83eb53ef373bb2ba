#pragma once

#include <functional>
#include <string>
#include <vector>

#include "visual_localization/localization/localizer_config.h"
#include "visual_localization/map/map_file.h"
#include "visual_localization/parameters/parameter_visitor.h"

namespace visual_localization {

/// Parameters of the ROS node alone.
struct NodeConfig {
  std::string map;                         ///< path of the map file; empty: wait for ~load_map
  int map_cache_mb = kDefaultMapCache_mb;  ///< memory for features; those of a larger map are read when needed
  std::string map_directory;               ///< only maps below this folder may be opened; empty: all
  std::string image_transport = "raw";     ///< raw, compressed (decoded here), or another installed transport
  std::string tf_mode = "none";            ///< none, map_to_odom, map_to_base
  double transform_tolerance_s = 0.1;      ///< added to the image stamp in the stamp of the transform
  double image_timeout_s = 5.0;            ///< longer without an image is an error
  std::string global_frame_id = "map";
  std::string odom_frame_id = "odom";
  std::string base_frame_id = "base_link";

  void declare(ParameterVisitor& visitor);
  /// How maps are opened; `warn` is told of features that cannot be read.
  MapLoading mapLoading(std::function<void(const std::string&)> warn) const;
};

/// Everything in the private namespace of the node.
struct NodeParameters {
  NodeConfig node;
  LocalizerConfig localizer;

  void declare(ParameterVisitor& visitor);
};

/// doc/parameters.md: every parameter of the localizer and of the map builder, generated from their declarations.
std::string parametersPage();
/// config/localizer.yaml and config/map_builder.yaml, generated from the same declarations.
std::string localizerYaml();
std::string mapBuilderYaml();

/// The map file that `path` names when only maps below `directory` may be opened: a relative path begins there, and
/// symbolic links and ".." are followed. Without a directory, the path as it is. Throws MapStoreError, in one line that
/// begins with the path, for a file that lies elsewhere.
std::string mapFileBelow(const std::string& directory, const std::string& path);

}  // namespace visual_localization

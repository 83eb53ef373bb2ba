#pragma once

#include <functional>
#include <string>
#include <vector>

#include <ros/node_handle.h>
#include <xmlrpcpp/XmlRpcValue.h>

#include "visual_localization/localization/localizer_config.h"
#include "visual_localization/map/map_file.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// Parameters of the ROS node alone.
struct NodeConfig {
  std::string map;
  int map_cache_mb = kDefaultMapCache_mb;
  std::string map_directory;
  std::string image_transport = "raw";
  std::string camera_info_file;
  std::string camera_mount;
  std::string mask_file;
  std::string usage_file;
  std::string session_folder;
  std::string tf_mode = "none";
  bool tf_metric_only = true;
  double tf_rate_hz = 0.0;
  double tf_smoothing_s = 0.5;
  bool use_odometry = false;
  double transform_tolerance_s = 0.1;
  double image_timeout_s = 5.0;
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
/// begins with the path and names the `parameter` that asks for it, for a file that lies elsewhere.
std::string mapFileBelow(const std::string& directory, const std::string& path,
                         const std::string& parameter = "map_directory");

/// Nested values of a parameter server as flat ones, "dpso/particles". Throws ParameterError naming the
/// parameter for anything that is neither a struct nor a scalar.
ParameterValues flatten(const XmlRpc::XmlRpcValue& tree);

/// Writes values into a node's private namespace. Returns false at the first one that no master takes.
bool storeParameters(const ros::NodeHandle& private_node, const ParameterValues& values);

/// True for parameters that stand in a node's private namespace but belong to others: diagnostic_updater,
/// bond, the nodelet manager, plugins of image_transport.
bool belongsToOthers(const std::string& name);

/// Everything in the private namespace of a node but what belongs to others. Throws as flatten() does.
ParameterValues privateParameters(const ros::NodeHandle& private_node);

/// Reads and checks the whole private namespace of the localizer. Throws ParameterError at the first unknown or invalid
/// parameter.
NodeParameters loadParameters(const ros::NodeHandle& private_node);

}  // namespace visual_localization

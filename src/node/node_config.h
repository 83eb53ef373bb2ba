#pragma once

#include <functional>
#include <string>

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
  bool use_odometry = false;
  double transform_tolerance_s = 0.1;
  double image_timeout_s = 5.0;
  std::string global_frame_id = "map";
  std::string odom_frame_id = "odom";
  std::string base_frame_id = "base_link";

  void declare(ParameterVisitor& visitor);
  /// `warn` is told of features that cannot be read.
  MapLoading mapLoading(std::function<void(const std::string&)> warn) const;
};

/// Everything in the private namespace of the node.
struct NodeParameters {
  NodeConfig node;
  LocalizerConfig localizer;

  void declare(ParameterVisitor& visitor);
};

/// doc/parameters.md, generated from the declarations.
std::string parametersPage();
std::string localizerYaml();
std::string mapBuilderYaml();

/// A relative path begins at `directory`, and symbolic links and ".." are followed; without a directory, the path as it
/// is. Throws MapStoreError, in one line that begins with the path and names the `parameter`, for a file that lies
/// elsewhere.
std::string mapFileBelow(const std::string& directory, const std::string& path,
                         const std::string& parameter = "map_directory");

/// Nested values as flat ones, "dpso/particles". Throws ParameterError for anything that is neither a struct nor a
/// scalar.
ParameterValues flatten(const XmlRpc::XmlRpcValue& tree);

/// False at the first value that no master takes.
bool storeParameters(const ros::NodeHandle& private_node, const ParameterValues& values);

/// Of diagnostic_updater, bond, the nodelet manager and plugins of image_transport.
bool belongsToOthers(const std::string& name);

/// Without what belongs to others. Throws as flatten() does.
ParameterValues privateParameters(const ros::NodeHandle& private_node);

/// Throws ParameterError at the first unknown or invalid parameter.
NodeParameters loadParameters(const ros::NodeHandle& private_node);

}  // namespace visual_localization

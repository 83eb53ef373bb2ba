#pragma once

#include <functional>
#include <mutex>
#include <string>

#include <dynamic_reconfigure/Config.h>
#include <dynamic_reconfigure/ConfigDescription.h>
#include <dynamic_reconfigure/Reconfigure.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/service_server.h>

#include "node/node_config.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// Of every parameter that can change while the node runs. Names are the full ones, "dpso/particles"; the group "dpso/"
/// holds all that begin with it.
dynamic_reconfigure::ConfigDescription toDescription(const parameters::Declaration& declare);

dynamic_reconfigure::Config toConfig(const parameters::Declaration& declare);

/// Throws ParameterError, with name and value, for one that is read at the start only.
ParameterValues toValues(const dynamic_reconfigure::Config& config, const parameters::Declaration& declare);

/// The parameters while the node runs, by the protocol of dynamic_reconfigure. Its own server template needs a class
/// generated from a .cfg file; here everything comes from the declarations that also check the start. The values are
/// stored on the parameter server as well, so that `rosparam dump` shows those in force. Thread-safe.
class ReconfigureServer {
 public:
  /// Throws when parameters cannot be put into effect, and then nothing has changed. `changed`: never empty.
  using Apply = std::function<void(const NodeParameters& parameters, const ParameterValues& changed)>;
  using Warn = std::function<void(const std::string& reason)>;

  /// Requests are answered in the callback queue of `private_node`.
  ReconfigureServer(const ros::NodeHandle& private_node, const NodeParameters& parameters, Apply apply, Warn warn);

  /// So that a restart finds the map.
  void setMap(const std::string& path);

 private:
  bool onSet(dynamic_reconfigure::Reconfigure::Request& request, dynamic_reconfigure::Reconfigure::Response& response);

  std::mutex mutex_;
  ros::NodeHandle private_node_;
  NodeParameters parameters_;
  Apply apply_;
  Warn warn_;
  ros::Publisher descriptions_;
  ros::Publisher updates_;
  ros::ServiceServer service_;  ///< last: it refers to everything above
};

}  // namespace visual_localization

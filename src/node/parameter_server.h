#pragma once

#include <string>

#include <ros/node_handle.h>
#include <xmlrpcpp/XmlRpcValue.h>

#include "node/node_config.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// Nested values of a parameter server as flat ones, "dpso/particles". Throws ParameterError naming the
/// parameter for anything that is neither a struct nor a scalar.
ParameterValues flatten(const XmlRpc::XmlRpcValue& tree);

/// Writes values into a node's private namespace. Without a master it writes nothing and returns false: roscpp would
/// wait.
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

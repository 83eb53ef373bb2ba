#include "visual_localization/ros/reconfigure_server.h"

#include <exception>
#include <utility>

#include "visual_localization/parameters/parameters.h"
#include "visual_localization/ros/parameter_server.h"
#include "visual_localization/ros/reconfigure_messages.h"

namespace visual_localization {
namespace {

/// `parameters` must outlive it.
parameters::Declaration declarationOf(NodeParameters& parameters) {
  return [&parameters](ParameterVisitor& visitor) { parameters.declare(visitor); };
}

/// The values of `after` that differ from those of `before`.
ParameterValues difference(NodeParameters before, NodeParameters after) {
  const ParameterValues old_values = parameters::values(declarationOf(before));
  ParameterValues values = parameters::values(declarationOf(after));
  for (const auto& [name, value] : old_values) {
    if (values.at(name) == value) values.erase(name);
  }
  return values;
}

}  // namespace

ReconfigureServer::ReconfigureServer(const ros::NodeHandle& private_node, const NodeParameters& parameters, Apply apply,
                                     Warn warn)
    : private_node_(private_node), parameters_(parameters), apply_(std::move(apply)), warn_(std::move(warn)) {
  constexpr bool kLatched = true;
  NodeParameters defaults;
  descriptions_ =
      private_node_.advertise<dynamic_reconfigure::ConfigDescription>("parameter_descriptions", 1, kLatched);
  descriptions_.publish(toDescription(declarationOf(defaults)));
  updates_ = private_node_.advertise<dynamic_reconfigure::Config>("parameter_updates", 1, kLatched);
  updates_.publish(toConfig(declarationOf(parameters_)));
  storeParameters(private_node_, parameters::values(declarationOf(parameters_)));
  service_ = private_node_.advertiseService("set_parameters", &ReconfigureServer::onSet, this);
}

void ReconfigureServer::setMap(const std::string& path) {
  const std::lock_guard<std::mutex> lock(mutex_);
  parameters_.node.map = path;
  storeParameters(private_node_, {{"map", path}});
}

/// Whatever is wrong, the answer and the update tell everybody which values hold.
bool ReconfigureServer::onSet(dynamic_reconfigure::Reconfigure::Request& request,
                              dynamic_reconfigure::Reconfigure::Response& response) {
  const std::lock_guard<std::mutex> lock(mutex_);
  try {
    NodeParameters changed = parameters_;
    assignParameters(changed, toValues(request.config, declarationOf(changed)));
    const ParameterValues values = difference(parameters_, changed);
    if (!values.empty()) apply_(changed, values);
    parameters_ = changed;
    if (!storeParameters(private_node_, values)) warn_("the new values hold, but there is no master to store them");
  } catch (const std::exception& error) {
    warn_(std::string("not changed: ") + error.what());
  }
  response.config = toConfig(declarationOf(parameters_));
  updates_.publish(response.config);
  return true;
}

}  // namespace visual_localization

#include "node/reconfigure_server.h"

#include <algorithm>
#include <cstdint>
#include <exception>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/text.h"
#include "node/node_config.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {
namespace {

using dynamic_reconfigure::Config;

template <class Parameters, class Value>
void append(Parameters& parameters, const std::string& name, const Value& value) {
  parameters.emplace_back();
  parameters.back().name = name;
  parameters.back().value = value;
}

/// "dpso/" of "dpso/particles": with the slash, because rqt_reconfigure takes a group "state" for the key of that name
/// that every group has.
std::string groupOf(const std::string& name) {
  const auto slash = name.find('/');
  return slash == std::string::npos ? "Default" : name.substr(0, slash + 1);
}

/// A Python dictionary, which the tools evaluate; options are plain words.
std::string enumOf(const std::vector<std::string>& options) {
  std::vector<std::string> entries;
  for (const std::string& option : options) {
    entries.push_back("{'name': '" + option + "', 'type': 'str', 'value': '" + option +
                      "', 'description': '', 'srcline': 0, 'srcfile': '', 'cconsttype': 'const char * const', "
                      "'ctype': 'std::string'}");
  }
  return "{'enum': [" + joined(entries) + "], 'enum_description': ''}";
}

/// Leaves out what is read at the start only.
class RunTimeVisitor : public ParameterVisitor {
 public:
  void real(const ParameterInfo& info, double& field, double min, double max) final {
    if (!info.at_start_only) onReal(info, field, min, max);
  }
  void integer(const ParameterInfo& info, int& field, int min, int max) final {
    if (!info.at_start_only) onInteger(info, field, min, max);
  }
  void flag(const ParameterInfo& info, bool& field) final {
    if (!info.at_start_only) onFlag(info, field);
  }
  void choice(const ParameterInfo& info, std::string& field, const std::vector<std::string>& options) final {
    if (!info.at_start_only) onText(info, field, enumOf(options));
  }
  void text(const ParameterInfo& info, std::string& field) final {
    if (!info.at_start_only) onText(info, field, "");
  }

 private:
  virtual void onReal(const ParameterInfo& info, double value, double min, double max) = 0;
  virtual void onInteger(const ParameterInfo& info, int value, int min, int max) = 0;
  virtual void onFlag(const ParameterInfo& info, bool value) = 0;
  virtual void onText(const ParameterInfo& info, const std::string& value, const std::string& edit_method) = 0;
};

class Describer final : public RunTimeVisitor {
 public:
  Describer() { groupNamed("Default"); }

  dynamic_reconfigure::ConfigDescription description;

 private:
  void onReal(const ParameterInfo& info, double value, double min, double max) override {
    describe(info, "double", "");
    append(description.dflt.doubles, info.name, value);
    append(description.min.doubles, info.name, min);
    append(description.max.doubles, info.name, max);
  }
  void onInteger(const ParameterInfo& info, int value, int min, int max) override {
    describe(info, "int", "");
    append(description.dflt.ints, info.name, value);
    append(description.min.ints, info.name, min);
    append(description.max.ints, info.name, max);
  }
  void onFlag(const ParameterInfo& info, bool value) override {
    describe(info, "bool", "");
    append(description.dflt.bools, info.name, value);
    append(description.min.bools, info.name, false);
    append(description.max.bools, info.name, true);
  }
  void onText(const ParameterInfo& info, const std::string& value, const std::string& edit_method) override {
    describe(info, "str", edit_method);
    append(description.dflt.strs, info.name, value);
    append(description.min.strs, info.name, std::string());
    append(description.max.strs, info.name, std::string());
  }

  dynamic_reconfigure::Group& groupNamed(const std::string& name) {
    auto& groups = description.groups;
    const auto found =
        std::find_if(groups.begin(), groups.end(), [&name](const auto& group) { return group.name == name; });
    if (found != groups.end()) return *found;
    dynamic_reconfigure::Group group;
    group.name = name;
    group.id = static_cast<std::int32_t>(groups.size());
    groups.push_back(group);
    return groups.back();
  }

  void describe(const ParameterInfo& info, const std::string& type, const std::string& edit_method) {
    dynamic_reconfigure::ParamDescription parameter;
    parameter.name = info.name;
    parameter.type = type;
    parameter.description = info.unit.empty() ? info.description : info.description + " [" + info.unit + "]";
    parameter.edit_method = edit_method;
    groupNamed(groupOf(info.name)).parameters.push_back(parameter);
  }
};

class AtStartOnly final : public ParameterVisitor {
 public:
  void real(const ParameterInfo& info, double&, double, double) override { add(info); }
  void integer(const ParameterInfo& info, int&, int, int) override { add(info); }
  void flag(const ParameterInfo& info, bool&) override { add(info); }
  void choice(const ParameterInfo& info, std::string&, const std::vector<std::string>&) override { add(info); }
  void text(const ParameterInfo& info, std::string&) override { add(info); }

  std::set<std::string> names;

 private:
  void add(const ParameterInfo& info) {
    if (info.at_start_only) names.insert(info.name);
  }
};

/// `parameters` must outlive it.
parameters::Declaration declarationOf(NodeParameters& parameters) {
  return [&parameters](ParameterVisitor& visitor) { parameters.declare(visitor); };
}

ParameterValues difference(NodeParameters before, NodeParameters after) {
  const ParameterValues old_values = parameters::values(declarationOf(before));
  ParameterValues values = parameters::values(declarationOf(after));
  for (const auto& [name, value] : old_values) {
    if (values.at(name) == value) values.erase(name);
  }
  return values;
}

}  // namespace

dynamic_reconfigure::ConfigDescription toDescription(const parameters::Declaration& declare) {
  Describer describer;
  declare(describer);
  return describer.description;
}

Config toConfig(const parameters::Declaration& declare) {
  const auto description = toDescription(declare);
  Config config = description.dflt;
  for (const auto& group : description.groups) {
    dynamic_reconfigure::GroupState state;
    state.name = group.name;
    state.state = true;
    state.id = group.id;
    config.groups.push_back(state);
  }
  return config;
}

ParameterValues toValues(const Config& config, const parameters::Declaration& declare) {
  ParameterValues values;
  for (const auto& parameter : config.bools) values[parameter.name] = static_cast<bool>(parameter.value);
  for (const auto& parameter : config.ints) values[parameter.name] = std::int64_t{parameter.value};
  for (const auto& parameter : config.strs) values[parameter.name] = parameter.value;
  for (const auto& parameter : config.doubles) values[parameter.name] = parameter.value;
  AtStartOnly at_start_only;
  declare(at_start_only);
  for (const auto& [name, value] : values) {
    if (at_start_only.names.count(name) == 0) continue;
    throw ParameterError("parameter '" + name + "' = " + parameters::toString(value) +
                         " is not allowed: it is read at the start and cannot change while the node runs");
  }
  return values;
}

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

/// After a refusal too, answer and update contain the values in force.
bool ReconfigureServer::onSet(dynamic_reconfigure::Reconfigure::Request& request,
                              dynamic_reconfigure::Reconfigure::Response& response) {
  const std::lock_guard<std::mutex> lock(mutex_);
  try {
    NodeParameters changed = parameters_;
    assignParameters(changed, toValues(request.config, declarationOf(changed)));
    const ParameterValues values = difference(parameters_, changed);
    if (!values.empty()) apply_(changed, values);
    parameters_ = changed;
    if (!storeParameters(private_node_, values))
      warn_("the new values are in force, but the parameter server did not take them");
  } catch (const std::exception& error) {
    warn_(std::string("not changed: ") + error.what());
  }
  response.config = toConfig(declarationOf(parameters_));
  updates_.publish(response.config);
  return true;
}

}  // namespace visual_localization

#include "node/parameter_server.h"

#include <algorithm>
#include <array>
#include <cstdint>

#include <ros/master.h>

namespace visual_localization {
namespace {

using XmlRpc::XmlRpcValue;

void flattenInto(XmlRpcValue value, const std::string& name, ParameterValues& out) {
  switch (value.getType()) {
    case XmlRpcValue::TypeStruct:
      for (auto& [key, child] : value) flattenInto(child, name.empty() ? key : name + "/" + key, out);
      return;
    case XmlRpcValue::TypeBoolean:
      out[name] = static_cast<bool>(value);
      return;
    case XmlRpcValue::TypeInt:
      out[name] = std::int64_t{static_cast<int>(value)};
      return;
    case XmlRpcValue::TypeDouble:
      out[name] = static_cast<double>(value);
      return;
    case XmlRpcValue::TypeString:
      out[name] = static_cast<std::string>(value);
      return;
    default:
      throw ParameterError("parameter '" + name + "' must be a single value: true or false, number or string");
  }
}

XmlRpcValue toXmlRpc(const ParameterValue& value) {
  if (const auto* flag = std::get_if<bool>(&value)) return XmlRpcValue(*flag);
  if (const auto* integer = std::get_if<std::int64_t>(&value)) return XmlRpcValue(static_cast<int>(*integer));
  if (const auto* real = std::get_if<double>(&value)) return XmlRpcValue(*real);
  return XmlRpcValue(std::get<std::string>(value));
}

void dropForeign(XmlRpcValue& tree, XmlRpcValue& kept) {
  for (auto& [key, child] : tree) {
    if (!belongsToOthers(key)) kept[key] = child;
  }
}

}  // namespace

ParameterValues flatten(const XmlRpcValue& tree) {
  ParameterValues out;
  if (tree.valid()) flattenInto(tree, "", out);
  return out;
}

bool storeParameters(const ros::NodeHandle& private_node, const ParameterValues& values) {
  if (!ros::master::check()) return false;
  for (const auto& [name, value] : values) private_node.setParam(name, toXmlRpc(value));
  return true;
}

bool belongsToOthers(const std::string& name) {
  static constexpr std::array<const char*, 11> kOthers = {"diagnostic_period",
                                                          "diagnostic_updater",
                                                          "diagnostic_updater_fast",
                                                          "bond_disable",
                                                          "num_worker_threads",
                                                          "matches",
                                                          "dashboard",
                                                          "compressed",
                                                          "compressedDepth",
                                                          "theora",
                                                          "image"};
  const std::string head = name.substr(0, name.find('/'));
  return std::any_of(kOthers.begin(), kOthers.end(), [&head](const char* other) { return head == other; });
}

ParameterValues privateParameters(const ros::NodeHandle& private_node) {
  XmlRpcValue tree;
  XmlRpcValue ours;
  private_node.getParam(private_node.getNamespace(), tree);
  if (tree.getType() == XmlRpcValue::TypeStruct) dropForeign(tree, ours);
  return flatten(ours);
}

NodeParameters loadParameters(const ros::NodeHandle& private_node) {
  NodeParameters parameters;
  assignParameters(parameters, privateParameters(private_node));
  return parameters;
}

}  // namespace visual_localization

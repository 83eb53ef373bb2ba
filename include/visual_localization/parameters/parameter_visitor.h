#pragma once

#include <string>
#include <vector>

namespace visual_localization {

/// What a user needs to know about one parameter besides its value and range.
struct ParameterInfo {
  std::string name;            ///< relative name as in the YAML file and on the parameter server, e.g. "dpso/inertia"
  std::string unit;            ///< SI symbol, "px", "1" for a pure number; empty for names and switches
  std::string description;     ///< one sentence, with the papers' symbol where there is one
  bool at_start_only = false;  ///< read when the node starts; everything else can change while it runs
};

/// Walks over the fields of a configuration. Every configuration struct has a member
/// `void declare(ParameterVisitor&)` that names each field once, with unit, range and meaning; reading
/// from YAML or a parameter server, range checks and the documentation table are visitors over that one list.
class ParameterVisitor {
 public:
  virtual ~ParameterVisitor() = default;

  virtual void real(const ParameterInfo& info, double& field, double min, double max) = 0;
  virtual void integer(const ParameterInfo& info, int& field, int min, int max) = 0;
  virtual void flag(const ParameterInfo& info, bool& field) = 0;
  virtual void choice(const ParameterInfo& info, std::string& field, const std::vector<std::string>& options) = 0;
  virtual void text(const ParameterInfo& info, std::string& field) = 0;

  // Declared after the fields that they are about.
  /// A constraint across fields: `name`, that is `value`, must not exceed `limit_name`, that is `limit`.
  virtual void atMost(const std::string& /*name*/, double /*value*/, const std::string& /*limit_name*/,
                      double /*limit*/) {}
  /// Any other constraint: unless it `holds`, `value` of `name` is not allowed, and must be `allowed`.
  virtual void require(bool /*holds*/, const std::string& /*name*/, const std::string& /*value*/,
                       const std::string& /*allowed*/) {}
  /// `old_name` is refused with the name that the parameter has now.
  virtual void renamed(const std::string& /*old_name*/, const std::string& /*name*/) {}
};

}  // namespace visual_localization

#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <variant>
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
};

/// A parameter as a file or a parameter server delivers it.
using ParameterValue = std::variant<bool, std::int64_t, double, std::string>;
/// Values by full parameter name, nested names joined with '/'.
using ParameterValues = std::map<std::string, ParameterValue>;

/// A parameter that is unknown, of the wrong type or outside its range. The text names the parameter, the
/// value and what would be allowed, in one line.
class ParameterError : public std::runtime_error {
 public:
  explicit ParameterError(const std::string& text);
};

namespace parameters {

/// Presents every field of one configuration to a visitor.
using Declaration = std::function<void(ParameterVisitor&)>;

/// Sets the fields that `values` names. Throws ParameterError at the first value that is unknown, of the
/// wrong type or out of range, before any field has changed.
void assign(const Declaration& declare, const ParameterValues& values);

/// All ranges and constraints that do not hold, in words; empty when the configuration is valid.
std::vector<std::string> violations(const Declaration& declare);

/// The current value of every field.
ParameterValues values(const Declaration& declare);

/// A Markdown table of all parameters: name, default, unit, allowed values, meaning; `with_run_time`: also whether it
/// can change while the node runs.
std::string markdownTable(const Declaration& declare, bool with_run_time = false);

/// A YAML file of all parameters with their values, in sections, each with its range and meaning as comment.
std::string yamlFile(const Declaration& declare);

/// Reads a YAML file of nested mappings; an empty one names nothing. Throws ParameterError naming the file and the key
/// for anything that is not a mapping of names to scalars.
ParameterValues readYaml(const std::string& path);

/// Interprets text as a YAML scalar: true/false, an integer, a number, otherwise a string.
ParameterValue parseScalar(const std::string& text);

/// The value as a user would type it.
std::string toString(const ParameterValue& value);

}  // namespace parameters

/// All ranges and constraints of `config` that do not hold, in words; empty when it is valid.
template <class Config>
std::vector<std::string> violationsOf(const Config& config) {
  Config copy = config;
  return parameters::violations([&copy](ParameterVisitor& visitor) { copy.declare(visitor); });
}

/// The current value of every field of `config`.
template <class Config>
ParameterValues valuesOf(const Config& config) {
  Config copy = config;
  return parameters::values([&copy](ParameterVisitor& visitor) { copy.declare(visitor); });
}

/// `config` itself. Throws ParameterError with the first violation when there is one.
template <class Config>
const Config& requireValid(const Config& config) {
  const std::vector<std::string> wrong = violationsOf(config);
  if (!wrong.empty()) throw ParameterError(wrong.front());
  return config;
}

/// Sets the named fields of `config`. Throws ParameterError when a value or what comes out is not allowed, and then
/// nothing has changed.
template <class Config>
void assignParameters(Config& config, const ParameterValues& values) {
  Config changed = config;
  parameters::assign([&changed](ParameterVisitor& visitor) { changed.declare(visitor); }, values);
  config = requireValid(changed);
}

}  // namespace visual_localization

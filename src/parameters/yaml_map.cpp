#include "parameters/yaml_map.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include "base/files.h"
#include "base/text.h"

namespace visual_localization::parameters {
namespace {

/// `where`: what a refusal begins with.
std::string keyOf(const YAML::Node& key, const std::string& where) {
  if (!key.IsScalar()) throw ParameterError(where + ": has a key that is no text");
  return key.Scalar();
}

/// How much more is accepted: an alias may refer to the mapping that it is in, and aliases of mappings of aliases stand
/// for more entries than any memory has.
struct Allowance {
  int mappings_deep = 8;
  int entries = 10'000;  ///< of one mapping and all in it
};

void flattenInto(const YAML::Node& node, const std::string& prefix, const std::string& path, Allowance& left,
                 ParameterValues& out) {
  if (left.mappings_deep == 0) throw ParameterError(path + ": key '" + prefix + "' is nested too deeply");
  --left.mappings_deep;
  for (const auto& entry : node) {
    if (--left.entries < 0) throw ParameterError(path + ": has too many keys");
    const std::string key = keyOf(entry.first, path);
    const std::string name = prefix.empty() ? key : prefix + "/" + key;
    if (out.count(name) != 0) throw ParameterError(path + ": key '" + name + "' appears twice");
    if (entry.second.IsMap()) {
      flattenInto(entry.second, name, path, left, out);
    } else if (entry.second.IsScalar()) {
      // A quoted scalar carries the tag "!": it stays a string even when it looks like a number.
      const std::string text = entry.second.Scalar();
      out[name] = entry.second.Tag() == "!" ? ParameterValue(text) : parseScalar(text);
    } else {
      throw ParameterError(path + ": key '" + name + "' must be a single value or a mapping");
    }
  }
  ++left.mappings_deep;
}

/// Passes over a document.
struct Skipper : YAML::EventHandler {
  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}
};

/// Not YAML::LoadAll(): of a text that goes on with a stray "," it makes documents until no memory is left
/// (yaml-cpp 0.7, issue 1040).
bool hasMoreThanOneDocument(const std::string& text) {
  std::istringstream in(text);
  YAML::Parser parser(in);
  Skipper skipper;
  return parser.HandleNextDocument(skipper) && static_cast<bool>(parser);
}

/// The parameters of a mapping, nested names joined with '/'.
ParameterValues flatten(const YAML::Node& mapping, const std::string& path) {
  Allowance allowance;
  ParameterValues out;
  flattenInto(mapping, "", path, allowance, out);
  return out;
}

std::string quoted(const std::string& text) { return "'" + text + "'"; }

}  // namespace

ParameterValue parseScalar(const std::string& text) {
  const YAML::Node node(text);
  bool flag = false;
  std::int64_t integer = 0;
  double real = 0.0;
  if (YAML::convert<bool>::decode(node, flag)) return flag;
  if (YAML::convert<std::int64_t>::decode(node, integer)) return integer;
  if (YAML::convert<double>::decode(node, real)) return real;
  return text;
}

YamlMap::YamlMap(YamlMap&&) noexcept = default;
YamlMap& YamlMap::operator=(YamlMap&&) noexcept = default;
YamlMap::~YamlMap() = default;

YamlMap::YamlMap(const YAML::Node& node, std::string path, std::string prefix)
    : node_(std::make_unique<YAML::Node>(node)), path_(std::move(path)), prefix_(std::move(prefix)) {
  std::set<std::string> keys;
  for (const auto& entry : *node_) {
    const std::string key = keyOf(entry.first, prefix_.empty() ? path_ : path_ + ": " + quoted(prefix_));
    if (!keys.insert(key).second) refuse(key, "appears twice");
  }
}

YamlMap YamlMap::parse(const std::string& text, const std::string& path) {
  try {
    if (hasMoreThanOneDocument(text)) throw ParameterError(path + ": holds several documents, must be one mapping");
    const YAML::Node document = YAML::Load(text);
    if (!document.IsMap()) throw ParameterError(path + ": must be a mapping");
    return {document, path, ""};
  } catch (const YAML::Exception& error) {
    throw ParameterError(path + ": not valid YAML: " + error.what());
  }
}

bool YamlMap::has(const std::string& key) const { return (*node_)[key].IsDefined() && !(*node_)[key].IsNull(); }

YAML::Node YamlMap::take(const std::string& key) {
  known_.insert(key);
  return has(key) ? (*node_)[key] : YAML::Node(YAML::NodeType::Undefined);
}

YAML::Node YamlMap::takeRequired(const std::string& key) {
  const YAML::Node value = take(key);
  if (!value.IsDefined()) refuse(key, "is missing");
  return value;
}

std::string YamlMap::text(const std::string& key) {
  const YAML::Node value = takeRequired(key);
  if (!value.IsScalar()) refuse(key, "must be a single value");
  return value.Scalar();
}

std::string YamlMap::text(const std::string& key, const std::string& otherwise) {
  known_.insert(key);
  return has(key) ? text(key) : otherwise;
}

bool YamlMap::flag(const std::string& key, bool otherwise) {
  const std::string value = text(key, otherwise ? "true" : "false");
  const ParameterValue parsed = parseScalar(value);
  if (!std::holds_alternative<bool>(parsed)) refuse(key, "= " + value + " must be true or false");
  return std::get<bool>(parsed);
}

double YamlMap::real(const std::string& key, double otherwise, double min, double max) {
  if (!has(key)) {
    known_.insert(key);
    return otherwise;
  }
  const std::string value = text(key);
  double parsed = std::nan("");
  const bool is_number = YAML::convert<double>::decode(YAML::Node(value), parsed);
  if (!is_number || !(parsed >= min && parsed <= max)) {
    refuse(key, "= " + value + " must be a number in [" + toString(min) + ", " + toString(max) + "]");
  }
  return parsed;
}

std::size_t YamlMap::count(const std::string& key, std::size_t otherwise, std::size_t min, std::size_t max) {
  if (!has(key)) {
    known_.insert(key);
    return otherwise;
  }
  const std::string value = text(key);
  std::int64_t parsed = -1;
  const bool is_number = YAML::convert<std::int64_t>::decode(YAML::Node(value), parsed);
  if (!is_number || parsed < static_cast<std::int64_t>(min) || parsed > static_cast<std::int64_t>(max)) {
    refuse(key, "= " + value + " must be an integer in [" + std::to_string(min) + ", " + std::to_string(max) + "]");
  }
  return static_cast<std::size_t>(parsed);
}

YamlMap YamlMap::map(const std::string& key) {
  const YAML::Node value = takeRequired(key);
  if (!value.IsMap()) refuse(key, "must be a mapping");
  return {value, path_, prefix_ + key + "/"};
}

std::vector<YamlMap> YamlMap::maps(const std::string& key) {
  const YAML::Node value = takeRequired(key);
  if (!value.IsSequence() || value.size() == 0) refuse(key, "must be a list of mappings");
  std::vector<YamlMap> maps;
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (!value[i].IsMap()) refuse(key, "must be a list of mappings");
    maps.push_back({value[i], path_, prefix_ + key + "[" + std::to_string(i) + "]/"});
  }
  return maps;
}

std::size_t YamlMap::numbers(const std::string& key, std::size_t most) {
  const YAML::Node value = takeRequired(key);
  if (!value.IsSequence() || value.size() > most) {
    refuse(key, "must be a list of at most " + std::to_string(most) + " numbers");
  }
  for (const auto& item : value) {
    double number = 0.0;
    if (!item.IsScalar() || !YAML::convert<double>::decode(item, number)) refuse(key, "must hold numbers only");
  }
  return value.size();
}

std::vector<std::vector<std::string>> YamlMap::textLists(const std::string& key, std::size_t length) {
  const YAML::Node value = takeRequired(key);
  const std::string expected = "must be a list of lists of " + std::to_string(length) + " names";
  if (!value.IsSequence() || value.size() == 0) refuse(key, expected);
  std::vector<std::vector<std::string>> lists;
  for (const YAML::Node& item : value) {
    if (!item.IsSequence() || item.size() != length) refuse(key, expected);
    std::vector<std::string> list;
    for (const YAML::Node& name : item) {
      if (!name.IsScalar()) refuse(key, expected);
      list.push_back(name.Scalar());
    }
    lists.push_back(std::move(list));
  }
  return lists;
}

ParameterValues YamlMap::parameters(const std::string& key) {
  const YAML::Node value = take(key);
  if (!value.IsDefined()) return {};
  if (!value.IsMap()) refuse(key, "must be a mapping of parameter names to values");
  return flatten(value, path_ + ": " + prefix_ + key);
}

ParameterValues YamlMap::parameters() const { return flatten(*node_, path_); }

std::vector<std::pair<std::string, std::vector<std::string>>> YamlMap::sweep(const std::string& key) {
  std::vector<std::pair<std::string, std::vector<std::string>>> sweep;
  const YAML::Node value = take(key);
  if (!value.IsDefined()) return sweep;
  const std::string expected = "must be a mapping of parameter names to lists of values";
  if (!value.IsMap()) refuse(key, expected);
  for (const auto& entry : value) {
    if (!entry.second.IsSequence() || entry.second.size() == 0) refuse(key, expected);
    std::vector<std::string> values;
    for (const YAML::Node& item : entry.second) {
      if (!item.IsScalar()) refuse(key, expected);
      values.push_back(item.Scalar());
    }
    const std::string name = keyOf(entry.first, path_ + ": " + quoted(prefix_ + key));
    const bool twice = std::any_of(sweep.begin(), sweep.end(), [&name](const auto& one) { return one.first == name; });
    if (twice) refuse(key + "/" + name, "appears twice");
    sweep.emplace_back(name, std::move(values));
  }
  return sweep;
}

void YamlMap::requireNoMore() const {
  for (const auto& entry : *node_) {
    const std::string key = entry.first.Scalar();
    if (known_.count(key) != 0) continue;
    refuse(key, "is unknown; allowed here: " + joined(known_));
  }
}

void YamlMap::refuse(const std::string& key, const std::string& why) const {
  throw ParameterError(path_ + ": " + quoted(prefix_ + key) + " " + why);
}

std::string withoutKeys(const std::string& yaml, const std::vector<std::string>& keys) {
  try {
    YAML::Node node = YAML::Load(yaml);
    for (const std::string& key : keys) node.remove(key);
    return YAML::Dump(node);
  } catch (const YAML::Exception& error) {
    throw ParameterError(std::string("not valid YAML: ") + error.what());
  }
}

ParameterValues readYaml(const std::string& path) {
  try {
    const std::string text = readFile(path, kLargestYaml_bytes);
    if (!hasMoreThanOneDocument(text) && YAML::Load(text).IsNull()) return {};
    return YamlMap::parse(text, path).parameters();
  } catch (const FileError& error) {
    throw ParameterError(error.what());
  } catch (const YAML::Exception& error) {
    throw ParameterError(path + ": not valid YAML: " + error.what());
  }
}

}  // namespace visual_localization::parameters

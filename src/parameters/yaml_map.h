#pragma once

#include <cstddef>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "visual_localization/parameters/parameters.h"

namespace YAML {
class Node;
}

namespace visual_localization::parameters {

/// No file of parameters or experiment is larger; /dev/zero has no end.
constexpr std::size_t kLargestYaml_bytes = std::size_t{1} << 20U;

/// A mapping of a YAML file of which every key must be asked for: a key nobody knows is a mistake of the writer, and so
/// is one that appears twice. All errors are ParameterErrors of one line that name the file and the key.
class YamlMap {
 public:
  YamlMap(YamlMap&&) noexcept;
  YamlMap& operator=(YamlMap&&) noexcept;
  ~YamlMap();

  /// The mapping at the top of a text; `path` is for messages.
  static YamlMap parse(const std::string& text, const std::string& path);

  bool has(const std::string& key) const;
  /// Throws when the key is missing or no text.
  std::string text(const std::string& key);
  std::string text(const std::string& key, const std::string& otherwise);
  bool flag(const std::string& key, bool otherwise);
  double real(const std::string& key, double otherwise, double min, double max);
  std::size_t count(const std::string& key, std::size_t otherwise, std::size_t min, std::size_t max);
  /// Throws when the key is missing or no mapping.
  YamlMap map(const std::string& key);
  /// Throws when the key is missing or no list of mappings.
  std::vector<YamlMap> maps(const std::string& key);
  /// Throws when the key is missing or no list of lists of `length` texts.
  std::vector<std::vector<std::string>> textLists(const std::string& key, std::size_t length);
  /// How many numbers a list has. Throws when the key is missing, no list or one of more than `most` entries, or when
  /// an entry is no number.
  std::size_t numbers(const std::string& key, std::size_t most);
  /// Parameters, nested or with full names; none when the key is missing.
  ParameterValues parameters(const std::string& key);
  /// The same of the whole mapping.
  ParameterValues parameters() const;
  /// Parameter names with lists of texts; none when the key is missing.
  std::vector<std::pair<std::string, std::vector<std::string>>> sweep(const std::string& key);

  /// To be called when everything has been asked for. Throws when there is more.
  void requireNoMore() const;
  /// Throws: something is wrong with `key`.
  [[noreturn]] void refuse(const std::string& key, const std::string& why) const;

 private:
  YamlMap(const YAML::Node& node, std::string path, std::string prefix);
  YAML::Node take(const std::string& key);
  YAML::Node takeRequired(const std::string& key);

  std::unique_ptr<YAML::Node> node_;
  std::string path_;
  std::string prefix_;  ///< where in the file, for messages
  std::set<std::string> known_;
};

/// A mapping's text without comments and these keys: the same for texts that mean the same. Throws ParameterError when
/// it is not valid YAML.
std::string withoutKeys(const std::string& yaml, const std::vector<std::string>& keys);

}  // namespace visual_localization::parameters

#include "visual_localization/parameters/parameters.h"

#include <algorithm>
#include <limits>
#include <set>
#include <sstream>
#include <utility>

#include "base/text.h"

namespace visual_localization {
namespace {

constexpr std::size_t kLongestError = 10000;  ///< characters; with room for a list of all names

}  // namespace

ParameterError::ParameterError(const std::string& text) : std::runtime_error(oneLine(text, kLongestError)) {}

}  // namespace visual_localization

namespace visual_localization::parameters {
namespace {

std::string number(double value) {
  std::ostringstream out = numberStream(std::numeric_limits<double>::digits10);
  out << value;
  return out.str();
}

std::string range(double min, double max) { return "[" + number(min) + ", " + number(max) + "]"; }

std::string oneOf(const std::vector<std::string>& options) { return "one of " + joined(options); }

/// An option that is no name is the empty text.
std::string shown(const std::string& option) { return option.empty() ? "\"\"" : option; }

std::vector<std::string> shown(std::vector<std::string> options) {
  for (std::string& option : options) option = shown(option);
  return options;
}

bool contains(const std::vector<std::string>& options, const std::string& value) {
  for (const auto& option : options) {
    if (option == value) return true;
  }
  return false;
}

std::string notAllowed(const std::string& name, const std::string& value, const std::string& allowed) {
  return "parameter '" + name + "' = " + value + " is not allowed: must " + allowed;
}

[[noreturn]] void refuse(const std::string& name, const std::string& value, const std::string& allowed) {
  throw ParameterError(notAllowed(name, value, "be " + allowed));
}

/// Checks all values first, so that a later error cannot leave a half-changed configuration.
class Assigner : public ParameterVisitor {
 public:
  Assigner(const ParameterValues& values, bool write) : values_(values), write_(write) {}

  void real(const ParameterInfo& info, double& field, double min, double max) override {
    const ParameterValue* value = find(info.name);
    if (value == nullptr) return;
    double wanted = 0.0;
    if (const auto* as_real = std::get_if<double>(value)) {
      wanted = *as_real;
    } else if (const auto* as_integer = std::get_if<std::int64_t>(value)) {
      wanted = static_cast<double>(*as_integer);
    } else {
      refuse(info.name, toString(*value), "a number in " + range(min, max));
    }
    if (!(wanted >= min && wanted <= max)) refuse(info.name, number(wanted), "in " + range(min, max));
    if (write_) field = wanted;
  }

  void integer(const ParameterInfo& info, int& field, int min, int max) override {
    const ParameterValue* value = find(info.name);
    if (value == nullptr) return;
    const auto* wanted = std::get_if<std::int64_t>(value);
    if (wanted == nullptr || *wanted < min || *wanted > max) {
      refuse(info.name, toString(*value), "an integer in " + range(min, max));
    }
    if (write_) field = static_cast<int>(*wanted);
  }

  void flag(const ParameterInfo& info, bool& field) override {
    const ParameterValue* value = find(info.name);
    if (value == nullptr) return;
    const auto* wanted = std::get_if<bool>(value);
    if (wanted == nullptr) refuse(info.name, toString(*value), "true or false");
    if (write_) field = *wanted;
  }

  void choice(const ParameterInfo& info, std::string& field, const std::vector<std::string>& options) override {
    const ParameterValue* value = find(info.name);
    if (value == nullptr) return;
    const auto* wanted = std::get_if<std::string>(value);
    if (wanted == nullptr || !contains(options, *wanted)) refuse(info.name, toString(*value), oneOf(options));
    if (write_) field = *wanted;
  }

  void text(const ParameterInfo& info, std::string& field) override {
    const ParameterValue* value = find(info.name);
    if (value == nullptr) return;
    const auto* wanted = std::get_if<std::string>(value);
    if (wanted == nullptr) refuse(info.name, toString(*value), "a string");
    if (write_) field = *wanted;
  }

  void refuseUnknown() const {
    for (const auto& [name, value] : values_) {
      if (known_.count(name) != 0) continue;
      throw ParameterError("parameter '" + name + "' = " + toString(value) + " is unknown; known are " +
                           joined(known_));
    }
  }

 private:
  const ParameterValue* find(const std::string& name) {
    known_.insert(name);
    const auto found = values_.find(name);
    return found == values_.end() ? nullptr : &found->second;
  }

  const ParameterValues& values_;
  bool write_;
  std::set<std::string> known_;
};

class RangeChecker : public ParameterVisitor {
 public:
  void real(const ParameterInfo& info, double& field, double min, double max) override {
    if (!(field >= min && field <= max)) report(info.name, number(field), "in " + range(min, max));
  }
  void integer(const ParameterInfo& info, int& field, int min, int max) override {
    if (field < min || field > max) report(info.name, std::to_string(field), "an integer in " + range(min, max));
  }
  void flag(const ParameterInfo&, bool&) override {}
  void choice(const ParameterInfo& info, std::string& field, const std::vector<std::string>& options) override {
    if (!contains(options, field)) report(info.name, field, oneOf(options));
  }
  void text(const ParameterInfo&, std::string&) override {}
  void atMost(const std::string& name, double value, const std::string& limit_name, double limit) override {
    if (value <= limit) return;
    violations.push_back(notAllowed(name, number(value), "not exceed '" + limit_name + "' = " + number(limit)));
  }
  void require(bool holds, const std::string& name, const std::string& value, const std::string& allowed) override {
    if (!holds) report(name, value, allowed);
  }

  std::vector<std::string> violations;

 private:
  void report(const std::string& name, const std::string& value, const std::string& allowed) {
    violations.push_back(notAllowed(name, value, "be " + allowed));
  }
};

class Collector : public ParameterVisitor {
 public:
  void real(const ParameterInfo& info, double& field, double, double) override { collected[info.name] = field; }
  void integer(const ParameterInfo& info, int& field, int, int) override { collected[info.name] = std::int64_t{field}; }
  void flag(const ParameterInfo& info, bool& field) override { collected[info.name] = field; }
  void choice(const ParameterInfo& info, std::string& field, const std::vector<std::string>&) override {
    collected[info.name] = field;
  }
  void text(const ParameterInfo& info, std::string& field) override { collected[info.name] = field; }

  ParameterValues collected;
};

class TableWriter : public ParameterVisitor {
 public:
  explicit TableWriter(bool with_run_time)
      : table(with_run_time
                  ? "| parameter | default | unit | allowed | while running | meaning |\n|---|---|---|---|---|---|\n"
                  : "| parameter | default | unit | allowed | meaning |\n|---|---|---|---|---|\n"),
        with_run_time_(with_run_time) {}

  void real(const ParameterInfo& info, double& field, double min, double max) override {
    row(info, number(field), range(min, max));
  }
  void integer(const ParameterInfo& info, int& field, int min, int max) override {
    row(info, std::to_string(field), range(min, max));
  }
  void flag(const ParameterInfo& info, bool& field) override { row(info, field ? "true" : "false", "true, false"); }
  void choice(const ParameterInfo& info, std::string& field, const std::vector<std::string>& options) override {
    row(info, shown(field), oneOf(shown(options)));
  }
  void text(const ParameterInfo& info, std::string& field) override { row(info, "\"" + field + "\"", "text"); }

  std::string table;

 private:
  void row(const ParameterInfo& info, const std::string& value, const std::string& allowed) {
    const std::string run_time = with_run_time_ ? std::string(info.at_start_only ? "" : "yes") + " | " : "";
    table += "| `" + info.name + "` | " + value + " | " + info.unit + " | " + allowed + " | " + run_time +
             info.description + " |\n";
  }

  const bool with_run_time_;
};

/// `(unit, )range`, for the comment of a YAML file.
std::string rangeComment(const ParameterInfo& info, const std::string& allowed) {
  return (info.unit.empty() || info.unit == "1" ? "" : info.unit + " ") + allowed;
}

class YamlWriter : public ParameterVisitor {
 public:
  void real(const ParameterInfo& info, double& field, double min, double max) override {
    line(info, number(field), rangeComment(info, range(min, max)));
  }
  void integer(const ParameterInfo& info, int& field, int min, int max) override {
    line(info, std::to_string(field), rangeComment(info, "integer " + range(min, max)));
  }
  void flag(const ParameterInfo& info, bool& field) override { line(info, field ? "true" : "false", "true or false"); }
  void choice(const ParameterInfo& info, std::string& field, const std::vector<std::string>& options) override {
    line(info, shown(field), oneOf(shown(options)));
  }
  void text(const ParameterInfo& info, std::string& field) override { line(info, "\"" + field + "\"", "text"); }

  /// Parameters without a section first, then the sections in order of declaration.
  std::string file() const {
    std::string text = top_;
    for (const auto& [name, lines] : sections_) text += "\n" + name + ":\n" + lines;
    return text;
  }

 private:
  void line(const ParameterInfo& info, const std::string& value, const std::string& allowed) {
    const std::size_t slash = info.name.find('/');
    std::string text = slash == std::string::npos ? info.name : "  " + info.name.substr(slash + 1);
    text += ": " + value;
    constexpr std::size_t kCommentColumn = 40;
    text.resize(std::max(kCommentColumn, text.size()), ' ');
    text += "  # " + allowed + "; " + info.description + "\n";
    (slash == std::string::npos ? top_ : section(info.name.substr(0, slash))) += text;
  }

  std::string& section(const std::string& name) {
    for (auto& [known, lines] : sections_) {
      if (known == name) return lines;
    }
    return sections_.emplace_back(name, "").second;
  }

  std::string top_;
  std::vector<std::pair<std::string, std::string>> sections_;
};

}  // namespace

void assign(const Declaration& declare, const ParameterValues& values) {
  Assigner check(values, false);
  declare(check);
  check.refuseUnknown();
  Assigner write(values, true);
  declare(write);
}

std::vector<std::string> violations(const Declaration& declare) {
  RangeChecker checker;
  declare(checker);
  return checker.violations;
}

ParameterValues values(const Declaration& declare) {
  Collector collector;
  declare(collector);
  return collector.collected;
}

std::string markdownTable(const Declaration& declare, bool with_run_time) {
  TableWriter writer(with_run_time);
  declare(writer);
  return writer.table;
}

std::string yamlFile(const Declaration& declare) {
  YamlWriter writer;
  declare(writer);
  return writer.file();
}

std::string toString(const ParameterValue& value) {
  if (const auto* flag = std::get_if<bool>(&value)) return *flag ? "true" : "false";
  if (const auto* integer = std::get_if<std::int64_t>(&value)) return std::to_string(*integer);
  if (const auto* real = std::get_if<double>(&value)) return number(*real);
  return std::get<std::string>(value);
}

}  // namespace visual_localization::parameters

#include "apps/app_support.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <new>
#include <string>
#include <vector>

#include "base/files.h"

namespace visual_localization::apps {
namespace {

int fail(const CLI::App& app, std::string reason, int code) {
  std::replace(reason.begin(), reason.end(), '\n', ' ');
  std::cout.flush();
  std::cerr << app.get_name() << ": " << reason << std::endl;
  return code;
}

/// roslaunch appends "__name:=..." and "__log:=..." to every command line.
std::vector<const char*> withoutRosNames(int argc, char** argv) {
  std::vector<const char*> arguments(argv, argv + argc);
  const auto is_ros_name = [](const char* argument) {
    const std::string text = argument;
    return text.rfind("__", 0) == 0 && text.find(":=") != std::string::npos;
  };
  arguments.erase(std::remove_if(arguments.begin(), arguments.end(), is_ros_name), arguments.end());
  return arguments;
}

int runBody(const CLI::App& app, const std::function<void()>& body) {
  try {
    body();
    std::cout.flush();
    return std::cout ? kSuccess : fail(app, "standard output cannot be written", kFailedRun);
  } catch (const UsageError& error) {
    return fail(app, std::string(error.what()) + " (see --help)", kBadUsage);
  } catch (const std::bad_alloc&) {
    return fail(app, "out of memory", kFailedRun);
  } catch (const std::exception& error) {
    return fail(app, error.what(), kFailedRun);
  }
}

}  // namespace

int runProgram(CLI::App& app, int argc, char** argv, const std::function<void()>& body) {
  app.set_version_flag("--version", app.get_name() + " " + VISUAL_LOCALIZATION_VERSION);
  try {
    const auto arguments = withoutRosNames(argc, argv);
    app.parse(static_cast<int>(arguments.size()), arguments.data());
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    return fail(app, std::string(error.what()) + " (see --help)", kBadUsage);
  }
  removePartialFilesOnSignals();
  return runBody(app, body);
}

void requireNoInput(const std::string& option, const std::string& output, const std::vector<std::string>& inputs) {
  namespace fs = std::filesystem;
  for (const std::string& input : inputs) {
    std::error_code none;
    const bool same_name = !input.empty() && fs::weakly_canonical(output, none) == fs::weakly_canonical(input, none);
    if (same_name || fs::equivalent(output, input, none)) {
      throw UsageError(option + " " + output + " would overwrite " + input);
    }
  }
}

std::string humanSize(double bytes) {
  static const std::array<const char*, 4> units{"B", "kB", "MB", "GB"};
  std::size_t unit = 0;
  while (bytes >= 1000.0 && unit + 1 < units.size()) {
    bytes /= 1000.0;
    ++unit;
  }
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), unit == 0 ? "%.0f %s" : "%.1f %s", bytes, units[unit]);
  return text.data();
}

}  // namespace visual_localization::apps

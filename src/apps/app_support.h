#pragma once

#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

/// What all programs share: options in, one line of error out.
namespace visual_localization::apps {

/// The command line asks for something that makes no sense. Ends the program with kBadUsage.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

constexpr int kSuccess = 0;
constexpr int kFailedRun = 1;
constexpr int kBadUsage = 2;

/// Adds --version, parses the command line and runs `body`; returns the program's exit code. Whatever goes wrong
/// becomes one line on standard error. Unfinished output disappears, also when the program is interrupted.
int runProgram(CLI::App& app, int argc, char** argv, const std::function<void()>& body);

/// Throws UsageError, naming the option, when the file to write is one of the files to read.
void requireNoInput(const std::string& option, const std::string& output, const std::vector<std::string>& inputs);

/// "1.2 kB", "3.4 MB".
std::string humanSize(double bytes);

}  // namespace visual_localization::apps

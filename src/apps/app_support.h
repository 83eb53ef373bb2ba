#pragma once

#include <chrono>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

namespace visual_localization::apps {

/// The command line asks for something that makes no sense; the program ends with exit code 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// One line on standard error: names and texts from outside may have control characters or no end.
void warn(const std::string& text);

/// Throws UsageError, naming the option, when the file to write is one of the files to read.
void requireNoInput(const std::string& option, const std::string& output, const std::vector<std::string>& inputs);

/// In capital letters: ".HTML" of "page.html"; empty without any.
std::string endingOf(const std::string& path);

/// "1.2 kB", "3.4 MB".
std::string humanSize(double bytes);

/// Runs a script that is installed beside this program, and shows its warnings. Throws std::runtime_error with the last
/// line of its standard error.
void runScript(const std::string& name, const std::vector<std::string>& arguments);

/// A line on standard error, on a terminal only, for steps that take more than two seconds; it leaves nothing behind.
class ProgressBar {
 public:
  explicit ProgressBar(std::string label);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void show(std::size_t done, std::size_t total);

 private:
  using Clock = std::chrono::steady_clock;

  std::string timeLeft(std::size_t done, std::size_t total) const;

  std::string label_;
  bool terminal_;
  bool visible_ = false;
  Clock::time_point start_;
  Clock::time_point next_;
};

}  // namespace visual_localization::apps

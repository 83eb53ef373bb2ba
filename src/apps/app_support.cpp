#include "apps/app_support.h"

#include <array>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <utility>

#include <unistd.h>

#include "base/process.h"
#include "base/text.h"

namespace visual_localization::apps {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::milliseconds kDelay{2000};
constexpr std::chrono::milliseconds kInterval{100};
constexpr std::size_t kWidth = 40;

}  // namespace

void warn(const std::string& text) {
  constexpr std::size_t kLongest = 10000;  // as long as a refusal that lists all parameters
  std::cerr << oneLine(text, kLongest) << std::endl;
}

void requireNoInput(const std::string& option, const std::string& output, const std::vector<std::string>& inputs) {
  for (const std::string& input : inputs) {
    std::error_code none;
    const bool same_name = !input.empty() && fs::weakly_canonical(output, none) == fs::weakly_canonical(input, none);
    if (same_name || fs::equivalent(output, input, none)) {
      throw UsageError(option + " " + output + " would overwrite " + input);
    }
  }
}

std::string endingOf(const std::string& path) { return upperCase(fs::path(path).extension().string()); }

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

void runScript(const std::string& name, const std::vector<std::string>& arguments) {
  std::vector<std::string> words{"--"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  // The file exists: what is missing is the interpreter that its first line names.
  std::cerr << ChildProcess(0, "is Python 3 installed? ").run(programBeside(name), words);
}

ProgressBar::ProgressBar(std::string label)
    : label_(std::move(label)), terminal_(::isatty(STDERR_FILENO) == 1), start_(Clock::now()), next_(start_ + kDelay) {}

ProgressBar::~ProgressBar() {
  if (visible_) std::fputs("\r\033[K", stderr);
}

void ProgressBar::show(std::size_t done, std::size_t total) {
  if (!terminal_ || total == 0 || Clock::now() < next_) return;
  next_ = Clock::now() + kInterval;
  visible_ = true;
  const std::size_t filled = kWidth * done / total;
  const std::string bar = std::string(filled, '#') + std::string(kWidth - filled, '.');
  std::fprintf(stderr, "\r%s [%s] %zu/%zu%s\033[K", label_.c_str(), bar.c_str(), done, total,
               timeLeft(done, total).c_str());
  std::fflush(stderr);
}

/// Nothing while the pace so far says little.
std::string ProgressBar::timeLeft(std::size_t done, std::size_t total) const {
  if (done == 0) return "";
  const double elapsed_s = std::chrono::duration<double>(Clock::now() - start_).count();
  const auto left_s = static_cast<long>(elapsed_s * static_cast<double>(total - done) / static_cast<double>(done));
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), ", %ld:%02ld left", left_s / 60, left_s % 60);
  return text.data();
}

}  // namespace visual_localization::apps

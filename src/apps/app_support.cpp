#include "apps/app_support.h"

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <utility>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/text.h"

extern char** environ;

namespace visual_localization::apps {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::milliseconds kDelay{2000};
constexpr std::chrono::milliseconds kInterval{100};
constexpr std::size_t kWidth = 40;

std::string readAll(int descriptor) {
  std::string text;
  std::array<char, 4096> block{};
  for (;;) {
    const ssize_t count = ::read(descriptor, block.data(), block.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return text;
    text.append(block.data(), static_cast<std::size_t>(count));
  }
}

std::string lastLine(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

/// Starts a program whose standard error goes to `error_output`; 0, or the error number.
int start(std::vector<std::string> command, int error_output, pid_t& process) {
  std::vector<char*> words;
  for (std::string& word : command) words.push_back(word.data());
  words.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, error_output, STDERR_FILENO);
  const int error = ::posix_spawn(&process, words.front(), &actions, nullptr, words.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  return error;
}

/// What a program writes to its standard error until it ends. Throws std::runtime_error with the reason when it cannot
/// be started, to which `hint` adds what may be missing, or fails.
std::string errorOutputOf(const std::vector<std::string>& command, const std::string& hint) {
  std::array<int, 2> pipe{};
  if (::pipe2(pipe.data(), O_CLOEXEC) != 0) throw std::runtime_error(std::strerror(errno));
  pid_t process = 0;
  const int error = start(command, pipe[1], process);
  ::close(pipe[1]);
  const std::string output = readAll(pipe[0]);
  ::close(pipe[0]);
  if (error != 0) throw std::runtime_error("cannot be started: " + hint + std::strerror(error));
  int status = 0;
  while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {
  }
  if (status != 0) throw std::runtime_error("failed: " + (output.empty() ? "without a message" : lastLine(output)));
  return output;
}

/// A program that is installed beside this one. `hint`: see errorOutputOf.
void runBeside(const std::string& name, const std::vector<std::string>& arguments, const std::string& hint) {
  const fs::path program = fs::read_symlink("/proc/self/exe").parent_path() / name;
  std::vector<std::string> command{program.string()};
  command.insert(command.end(), arguments.begin(), arguments.end());
  std::fflush(stdout);
  try {
    if (!fs::exists(program)) throw std::runtime_error("is missing");
    std::cerr << errorOutputOf(command, hint);  // warnings
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(program.string() + ": " + error.what());
  }
}

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

NewFolder::NewFolder(std::string path) : path_(std::move(path)) {
  std::error_code error;
  made_ = fs::create_directory(path_, error);
  if (!error && !fs::is_empty(path_, error) && !error) throw FileError(path_ + ": there is something in it already");
  if (error) throw FileError((path_.empty() ? "''" : path_) + ": cannot be written: " + error.message());
}

NewFolder::~NewFolder() {
  if (committed_) return;
  files_.clear();
  std::error_code ignored;
  for (const std::string& name : names_) fs::remove(pathOf(name), ignored);
  if (made_) fs::remove(path_, ignored);
}

PartialFile& NewFolder::add(const std::string& name) {
  files_.push_back(std::make_unique<PartialFile>(pathOf(name)));
  names_.push_back(name);
  return *files_.back();
}

void NewFolder::commit() {
  for (const auto& file : files_) file->commit();
  committed_ = true;
}

std::string NewFolder::pathOf(const std::string& name) const { return (fs::path(path_) / name).string(); }

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

void runProgramBeside(const std::string& name, const std::vector<std::string>& arguments) {
  runBeside(name, arguments, "");
}

void runScript(const std::string& name, const std::vector<std::string>& arguments) {
  std::vector<std::string> words{"--"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  // The file exists: what is missing is the interpreter that its first line names.
  runBeside(name, words, "is Python 3 installed? ");
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

/// From the pace so far; nothing while that says little.
std::string ProgressBar::timeLeft(std::size_t done, std::size_t total) const {
  if (done == 0) return "";
  const double elapsed_s = std::chrono::duration<double>(Clock::now() - start_).count();
  const auto left_s = static_cast<long>(elapsed_s * static_cast<double>(total - done) / static_cast<double>(done));
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), ", %ld:%02ld left", left_s / 60, left_s % 60);
  return text.data();
}

}  // namespace visual_localization::apps

#include "apps/evaluation_report.h"

#include <array>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <stdexcept>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

extern char** environ;

namespace visual_localization::apps {
namespace {

/// Whether the program succeeded, and what it said on its standard error.
struct Outcome {
  bool succeeded = false;
  std::string errors;
};

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

Outcome runProgram(std::string program, std::string argument) {
  std::array<int, 2> pipe{};
  if (::pipe2(pipe.data(), O_CLOEXEC) != 0) return {};
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, pipe[1], STDERR_FILENO);
  std::string end_of_options = "--";
  const std::array<char*, 4> arguments{program.data(), end_of_options.data(), argument.data(), nullptr};
  pid_t process = 0;
  const bool started = ::posix_spawn(&process, program.c_str(), &actions, nullptr, arguments.data(), environ) == 0;
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(pipe[1]);
  Outcome outcome;
  int status = 0;
  outcome.errors = readAll(pipe[0]);
  ::close(pipe[0]);
  outcome.succeeded = started && ::waitpid(process, &status, 0) == process && status == 0;
  return outcome;
}

std::string lastLine(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

}  // namespace

void drawReport(const std::string& folder) {
  namespace fs = std::filesystem;
  const fs::path script = fs::read_symlink("/proc/self/exe").parent_path() / "report_evaluation.py";
  const std::string again = "; the tables are written, draw them with: report_evaluation.py -- " + folder;
  if (!fs::exists(script)) throw std::runtime_error(script.string() + ": is missing" + again);
  std::fflush(stdout);
  const Outcome outcome = runProgram(script.string(), folder);
  if (!outcome.succeeded) throw std::runtime_error(script.string() + ": failed: " + lastLine(outcome.errors) + again);
  std::cerr << outcome.errors;  // warnings
}

}  // namespace visual_localization::apps

#include "base/process.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include <dlfcn.h>
#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

extern char** environ;

namespace visual_localization {
namespace {

namespace fs = std::filesystem;

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

/// The file that this function was loaded from.
fs::path thisLibrary() {
  Dl_info info{};
  static const int here = 0;
  if (::dladdr(&here, &info) == 0 || info.dli_fname == nullptr) return {};
  std::error_code none;
  return fs::weakly_canonical(info.dli_fname, none);
}

/// What RLIMIT_DATA counts, and the stack.
rlim_t writableBytes() {
  std::ifstream statm("/proc/self/statm");  // proc(5): size resident shared text lib data, in pages
  rlim_t pages = 0;
  for (int field = 0; field < 6; ++field) statm >> pages;
  return pages * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE));
}

void limitMemory(rlim_t most) {
  rlimit memory{};
  ::getrlimit(RLIMIT_DATA, &memory);
  memory.rlim_cur = std::min(memory.rlim_cur, most);
  ::setrlimit(RLIMIT_DATA, &memory);
  std::ofstream("/proc/self/oom_score_adj") << 1000;
}

/// What a copy does; it writes what is thrown to `error_output`.
[[noreturn]] void runHere(const std::function<void()>& run, unsigned longest_s, rlim_t most, int error_output) {
  for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGALRM}) ::signal(number, SIG_DFL);
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  ::dup2(nowhere, STDERR_FILENO);
  limitMemory(most);
  ::alarm(longest_s);
  const auto tell = [error_output](const char* text) {
    if (::write(error_output, text, std::strlen(text)) < 0) ::_exit(1);
  };
  try {
    run();
  } catch (const std::exception& error) {
    tell(error.what());
  } catch (...) {
    tell("unknown exception");
  }
  ::_exit(0);
}

}  // namespace

std::string programBeside(const std::string& name) {
  const fs::path program = fs::read_symlink("/proc/self/exe").parent_path() / name;
  if (!fs::exists(program)) throw std::runtime_error(program.string() + ": is missing");
  return program.string();
}

std::string programOfPackage(const std::string& name) {
  const fs::path libraries = thisLibrary().parent_path();
  // Debian has libraries one folder below.
  for (const fs::path& folder : {fs::read_symlink("/proc/self/exe").parent_path(), libraries / "visual_localization",
                                 libraries.parent_path() / "visual_localization"}) {
    if (fs::exists(folder / name)) return (folder / name).string();
  }
  return programBeside(name);
}

std::string howCopyEnds(const std::function<void()>& run, unsigned longest_s, std::size_t most_bytes) {
  std::array<int, 2> pipe{};
  if (::pipe2(pipe.data(), O_CLOEXEC) != 0) throw std::runtime_error(std::strerror(errno));
  const rlim_t most = writableBytes() + most_bytes;
  const pid_t copy = ::fork();
  const int fork_error = errno;
  if (copy == 0) runHere(run, longest_s, most, pipe[1]);
  ::close(pipe[1]);
  const std::string thrown = copy > 0 ? readAll(pipe[0]) : "";
  ::close(pipe[0]);
  if (copy < 0) throw std::runtime_error(std::string("no process for it: ") + std::strerror(fork_error));
  int status = 0;
  while (::waitpid(copy, &status, 0) != copy) {
    if (errno != EINTR) throw std::runtime_error(std::string("nobody knows how it ended: ") + std::strerror(errno));
  }
  if (status == 0 && !thrown.empty()) throw std::runtime_error(thrown);
  if (status == 0) return {};
  if (!WIFSIGNALED(status)) return "with exit code " + std::to_string(WEXITSTATUS(status));
  if (WTERMSIG(status) == SIGALRM) return "after " + std::to_string(longest_s) + " s without a result";
  return "by signal " + std::to_string(WTERMSIG(status)) + " (" + ::strsignal(WTERMSIG(status)) + ")";
}

std::string ChildProcess::run(const std::string& program, const std::vector<std::string>& arguments) {
  std::vector<std::string> command{program};
  command.insert(command.end(), arguments.begin(), arguments.end());
  std::fflush(stdout);
  try {
    return errorOutputOf(command);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(program + ": " + error.what());
  }
}

void ChildProcess::terminate() {
  const std::lock_guard<std::mutex> lock(mutex_);
  terminated_ = true;
  if (process_ > 0) ::kill(process_, SIGTERM);
}

std::string ChildProcess::errorOutputOf(const std::vector<std::string>& command) {
  std::array<int, 2> pipe{};
  if (::pipe2(pipe.data(), O_CLOEXEC) != 0) throw std::runtime_error(std::strerror(errno));
  pid_t process = 0;
  int error = 0;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    error = terminated_ ? ECANCELED : start(command, pipe[1], process);
    if (error == 0) process_ = process;
  }
  ::close(pipe[1]);
  if (error == 0 && niceness_ != 0) {
    ::setpriority(PRIO_PROCESS, static_cast<id_t>(process), ::getpriority(PRIO_PROCESS, 0) + niceness_);
  }
  const std::string output = readAll(pipe[0]);
  ::close(pipe[0]);
  if (error != 0) throw std::runtime_error("cannot be started: " + hint_ + std::strerror(error));
  if (waitFor(process) != 0) {
    throw std::runtime_error("failed: " + (output.empty() ? "without a message" : lastLine(output)));
  }
  return output;
}

/// Its status; not 0 when nobody knows how it ended.
int ChildProcess::waitFor(pid_t process) {
  siginfo_t ended{};
  while (::waitid(P_PID, static_cast<id_t>(process), &ended, WEXITED | WNOWAIT) != 0 && errno == EINTR) {
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  process_ = 0;  // before waitpid(): afterwards another process may get its number
  int status = 0;
  return ::waitpid(process, &status, 0) == process ? status : -1;
}

}  // namespace visual_localization

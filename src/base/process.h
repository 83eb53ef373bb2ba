#pragma once

#include <cstddef>
#include <functional>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <sys/types.h>

namespace visual_localization {

/// Where a program or script is that lies beside the running program. Throws std::runtime_error when it does not.
std::string programBeside(const std::string& name);
/// The same for a nodelet in another package's program, too: there it is where the library that this is in was
/// installed with it.
std::string programOfPackage(const std::string& name);

/// Runs something in a copy of this process, for libraries that a broken file ends instead of an exception. Empty when
/// it came to its end; otherwise how the copy ended: "by signal 11 (Segmentation fault)". What it throws is thrown here
/// as std::runtime_error. After `longest_s` it is ended. It is refused more than `most_bytes` of memory beyond what
/// this process has, and where memory runs out, the kernel ends it first.
std::string howCopyEnds(const std::function<void()>& run, unsigned longest_s, std::size_t most_bytes);

/// A program that runs as a process of its own.
class ChildProcess {
 public:
  /// `niceness`: how much nicer than this process, see nice(1). `hint`: what may be missing when it cannot be started.
  explicit ChildProcess(int niceness = 0, std::string hint = "") : niceness_(niceness), hint_(std::move(hint)) {}

  /// Runs a program to its end and returns what it wrote to its standard error; its output goes to ours. Throws
  /// std::runtime_error, in one line that begins with the program, when it cannot be started or fails: then with the
  /// last line that it wrote to its standard error. One call at a time.
  std::string run(const std::string& program, const std::vector<std::string>& arguments);
  /// Asks the program to end (SIGTERM), now and as soon as another one starts. From any thread.
  void terminate();

 private:
  std::string errorOutputOf(const std::vector<std::string>& command);
  int waitFor(pid_t process);

  const int niceness_;
  const std::string hint_;
  std::mutex mutex_;
  pid_t process_ = 0;  ///< that runs
  bool terminated_ = false;
};

}  // namespace visual_localization

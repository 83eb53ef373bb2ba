#include "base/unfinished_files.h"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <cstring>

#include <poll.h>
#include <unistd.h>

#include "base/files.h"

namespace visual_localization {
namespace {

/// The names of all unfinished files, in a form that a signal handler may read.
std::array<std::atomic<char*>, 32> unfinished{};

std::atomic<bool> ending{false};    ///< a signal ends the process
std::atomic<int> being_changed{0};  ///< threads that make a file and its entry in `unfinished`, or remove them

/// Those that end a program and leave it time to remove its files.
constexpr std::array<int, 4> kSignals{SIGHUP, SIGINT, SIGPIPE, SIGTERM};

sigset_t endingSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal_number : kSignals) sigaddset(&signals, signal_number);
  return signals;
}

/// For one thread, and by another signal for one more: both do the same.
void removeUnfinishedAndDie(int signal_number) {
  ending = true;
  while (being_changed > 0) ::poll(nullptr, 0, 1);
  for (auto& slot : unfinished) {
    const char* name = slot.load();
    if (name != nullptr) ::unlink(name);
  }
  ::signal(signal_number, SIG_DFL);  // whoever waits for this process sees how it ended
  ::raise(signal_number);
}

}  // namespace

FileChange::FileChange() {
  const sigset_t ending_signals = endingSignals();
  ::pthread_sigmask(SIG_BLOCK, &ending_signals, &before_);  // a handler in this thread would wait for itself
  ++being_changed;
  if (!ending) return;
  --being_changed;
  while (true) ::pause();  // the process ends at any moment
}

FileChange::~FileChange() {
  --being_changed;
  ::pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

int enlistUnfinished(const std::string& path) {
  char* name = ::strdup(path.c_str());
  for (std::size_t i = 0; name != nullptr && i < unfinished.size(); ++i) {
    char* expected = nullptr;
    if (unfinished[i].compare_exchange_strong(expected, name)) return static_cast<int>(i);
  }
  std::free(name);
  return -1;
}

void strikeUnfinished(int slot) {
  if (slot >= 0) std::free(unfinished[static_cast<std::size_t>(slot)].exchange(nullptr));
}

void removePartialFilesOnSignals() {
  struct sigaction action {};
  action.sa_handler = removeUnfinishedAndDie;
  action.sa_mask = endingSignals();
  for (const int signal_number : kSignals) {
    struct sigaction current {};
    // What the caller chose to ignore (nohup) stays ignored.
    if (::sigaction(signal_number, nullptr, &current) == 0 && current.sa_handler == SIG_IGN) continue;
    ::sigaction(signal_number, &action, nullptr);
  }
  ::signal(SIGXFSZ, SIG_IGN);
}

}  // namespace visual_localization

#include "base/file_locks.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <random>
#include <set>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/text.h"

namespace visual_localization {
namespace {

constexpr std::string_view kPartial = ".partial";
constexpr std::size_t kDigits = 16;

bool endsWith(std::string_view text, std::string_view end) {
  return text.size() > end.size() && text.substr(text.size() - end.size()) == end;
}

/// Whether it is a name that partialName() or an OutputLock gives.
bool isTemporary(std::string_view name) {
  if (endsWith(name, kLockSuffix)) return true;
  if (!endsWith(name, kPartial)) return false;
  name.remove_suffix(kPartial.size());
  if (name.size() < kDigits + 2 || name[name.size() - kDigits - 1] != '.') return false;
  return name.substr(name.size() - kDigits).find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

bool isFirstVisit(const std::string& folder) {
  static std::mutex mutex;
  static std::set<std::pair<pid_t, std::string>> visited;  // a child inherits what its parent has visited
  const std::lock_guard<std::mutex> lock(mutex);
  return visited.emplace(::getpid(), folder).second;
}

/// As in an errno: not a file that may be opened for writing without waiting for somebody.
int requireRegular(int descriptor) {
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) return errno;
  return S_ISREG(status.st_mode) ? 0 : EINVAL;
}

}  // namespace

std::string partialName(const std::string& target) {
  std::random_device random;
  std::array<char, kDigits + 1> digits{};
  std::snprintf(digits.data(), digits.size(), "%08x%08x", random(), random());
  return target + "." + digits.data() + std::string(kPartial);
}

bool isAt(int descriptor, const std::string& path) {
  struct stat open {};
  struct stat named {};
  return ::fstat(descriptor, &open) == 0 && ::lstat(path.c_str(), &named) == 0 && open.st_dev == named.st_dev &&
         open.st_ino == named.st_ino;
}

int openLocked(const std::string& path, int flags) {
  while (true) {
    const int descriptor = ::open(path.c_str(), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC | flags, 0666);
    if (descriptor < 0) return -1;
    int error = requireRegular(descriptor);
    if (error == 0 && ::flock(descriptor, LOCK_EX | LOCK_NB) != 0) error = errno;
    if (error == 0 && isAt(descriptor, path)) return descriptor;
    ::close(descriptor);
    errno = error;
    if (error != 0) return -1;  // otherwise its holder has removed it meanwhile
  }
}

void removeAbandoned(const std::string& folder) {
  if (!isFirstVisit(folder)) return;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (!isTemporary(entry->path().filename().string())) continue;
    const std::string path = entry->path().string();
    const int descriptor = openLocked(path, 0);
    if (descriptor < 0) continue;
    ::unlink(path.c_str());
    ::close(descriptor);
  }
}

void nameHolder(int descriptor) {
  std::array<char, 65> host{};
  ::gethostname(host.data(), host.size() - 1);
  const std::string holder = std::to_string(::getpid()) + " on " + host.data();
  // It only helps whoever reads the refusal.
  if (::ftruncate(descriptor, 0) != 0 || ::write(descriptor, holder.data(), holder.size()) < 0) return;
}

std::string holderIn(const std::string& path) {
  std::array<char, 100> holder{};
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  const ssize_t count = descriptor < 0 ? 0 : ::read(descriptor, holder.data(), holder.size() - 1);
  if (descriptor >= 0) ::close(descriptor);
  return count > 0 ? oneLine(holder.data()) : "of another program";
}

}  // namespace visual_localization

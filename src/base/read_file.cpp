#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <memory>
#include <string>

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/files.h"

namespace visual_localization {
namespace {

constexpr int kPipeWait_ms = 10'000;

[[noreturn]] void refuseToRead(const std::string& path, int error) {
  throw FileError((path.empty() ? "''" : path) + ": cannot be read: " + std::strerror(error));
}

/// A device has no end, as /dev/zero, or waits for somebody, as a terminal.
void requireReadable(const std::string& path, int descriptor) {
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) refuseToRead(path, errno);
  if (S_ISDIR(status.st_mode)) refuseToRead(path, EISDIR);
  if (S_ISREG(status.st_mode) || S_ISFIFO(status.st_mode)) return;
  throw FileError(path + ": cannot be read: it is neither a file nor a pipe");
}

/// How many bytes came; 0 at the end.
std::size_t readBlock(const std::string& path, int descriptor, std::array<char, 65536>& block) {
  while (true) {
    pollfd ready{descriptor, POLLIN, 0};
    const int found = ::poll(&ready, 1, kPipeWait_ms);
    if (found == 0) {
      throw FileError(path + ": cannot be read: nobody wrote into this pipe for " +
                      std::to_string(kPipeWait_ms / 1000) + " s");
    }
    const ssize_t count = found < 0 ? -1 : ::read(descriptor, block.data(), block.size());
    if (count >= 0) return static_cast<std::size_t>(count);
    if (errno != EINTR && errno != EAGAIN) refuseToRead(path, errno);
  }
}

}  // namespace

std::string readFile(const std::string& path, std::size_t most_bytes) {
  // Without waiting: a pipe into which nobody writes would hold the open itself up for ever.
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
  if (descriptor < 0) refuseToRead(path, errno);
  const std::shared_ptr<void> closed(nullptr, [descriptor](void*) { ::close(descriptor); });
  requireReadable(path, descriptor);
  std::string text;
  std::array<char, 65536> block{};
  while (const std::size_t count = readBlock(path, descriptor, block)) {
    text.append(block.data(), count);
    if (text.size() <= most_bytes) continue;
    throw FileError(path + ": has more than the " + std::to_string(most_bytes) + " bytes that are allowed");
  }
  return text;
}

}  // namespace visual_localization

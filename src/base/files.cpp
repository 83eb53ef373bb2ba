#include "base/files.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <mutex>
#include <optional>
#include <random>
#include <set>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include "base/text.h"
#include "base/unfinished_files.h"

namespace visual_localization {
namespace {

/// No other program ends its names like this: what is abandoned under such a name is removed.
constexpr std::string_view kPartial = ".visual_localization.partial";
constexpr std::size_t kDigits = 16;
/// What stands behind the name of a file while one process at a time may write it.
constexpr std::string_view kLockSuffix = ".lock.visual_localization.partial";
/// Times that an OutputLock is tried, 10 ms apart: removeAbandoned() of another process holds the file for a moment
/// too.
constexpr int kLockAttempts = 100;

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

/// A new name beside `target`: `<target>.<16 random hexadecimal digits>` and kPartial. Not by the process's number:
/// in two containers it may be the same.
std::string partialName(const std::string& target) {
  std::random_device random;
  std::array<char, kDigits + 1> digits{};
  std::snprintf(digits.data(), digits.size(), "%08x%08x", random(), random());
  return target + "." + digits.data() + std::string(kPartial);
}

/// Whether the open file is the one that has this name.
bool isAt(int descriptor, const std::string& path) {
  struct stat open {};
  struct stat named {};
  return ::fstat(descriptor, &open) == 0 && ::lstat(path.c_str(), &named) == 0 && open.st_dev == named.st_dev &&
         open.st_ino == named.st_ino;
}

/// As in an errno of flock(): the file system has no locks, as a network disk without its lock manager.
bool isWithoutLocks(int error) { return error == ENOLCK || error == EOPNOTSUPP || error == ENOSYS; }

/// Opens the file and locks it (flock) until the descriptor is closed or the process has ended, however. `flags`: more
/// of open(). Returns a descriptor, or -1 with errno: EWOULDBLOCK when another process holds it.
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

/// Whether another machine may be writing the file although it was locked here: some network disks, as NFS with
/// `nolock`, lock for one machine alone. After a day without a change nobody does.
bool mayBeInUseElsewhere(int descriptor) {
  constexpr std::array<std::uint32_t, 6> kNetworks{0x6969,     0x517B,     0xFF534D42,   // NFS, SMB, CIFS
                                                   0xFE534D42, 0x65735546, 0x01021997};  // SMB2, FUSE, 9P
  constexpr std::time_t kDay_s = 86400;
  struct statfs system {};
  struct stat status {};
  if (::fstatfs(descriptor, &system) == 0 &&
      std::find(kNetworks.begin(), kNetworks.end(), static_cast<std::uint32_t>(system.f_type)) == kNetworks.end()) {
    return false;
  }
  return ::fstat(descriptor, &status) != 0 || std::time(nullptr) - status.st_mtime < kDay_s;
}

/// Removes the temporary files in the folder, by their names, that no living process holds. Does so once for each
/// folder; what cannot be read, locked or removed stays.
void removeAbandoned(const std::string& folder) {
  if (!isFirstVisit(folder)) return;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (!isTemporary(entry->path().filename().string())) continue;
    const std::string path = entry->path().string();
    const int descriptor = openLocked(path, 0);
    if (descriptor < 0) continue;
    if (!mayBeInUseElsewhere(descriptor)) ::unlink(path.c_str());
    ::close(descriptor);
  }
}

/// Writes this process into the file: "12 on host".
void nameHolder(int descriptor) {
  std::array<char, 65> host{};
  ::gethostname(host.data(), host.size() - 1);
  const std::string holder = std::to_string(::getpid()) + " on " + host.data();
  // It only helps whoever reads the refusal.
  if (::ftruncate(descriptor, 0) != 0 || ::write(descriptor, holder.data(), holder.size()) < 0) return;
}

/// What nameHolder() wrote there.
std::string holderIn(const std::string& path) {
  std::array<char, 100> holder{};
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  const ssize_t count = descriptor < 0 ? 0 : ::read(descriptor, holder.data(), holder.size() - 1);
  if (descriptor >= 0) ::close(descriptor);
  return count > 0 ? oneLine(holder.data()) : "of another program";
}

[[noreturn]] void refuse(const std::string& path, const std::string& reason) {
  throw FileError(path + ": cannot be written: " + reason);
}

[[noreturn]] void refuse(const std::string& path, int error) { refuse(path, std::string(std::strerror(error))); }

std::string resolved(const std::string& path) {
  struct stat status {};
  if (::lstat(path.c_str(), &status) != 0 || !S_ISLNK(status.st_mode)) return path;
  std::error_code error;
  const auto target = std::filesystem::weakly_canonical(path, error);
  return error ? path : target.string();
}

std::string folderOf(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

void requireReplaceable(const std::string& shown, const std::string& target) {
  if (target.empty()) throw FileError("'': cannot be written: the name is empty");
  struct stat status {};
  if (::stat(folderOf(target).c_str(), &status) != 0) {
    refuse(shown, errno == ENOENT ? "its folder does not exist" : std::strerror(errno));
  }
  if (!S_ISDIR(status.st_mode)) refuse(shown, folderOf(target) + " is not a folder");
  if (target.back() == '/') refuse(shown, "it names a folder");
  if (::stat(target.c_str(), &status) != 0) return;
  if (S_ISDIR(status.st_mode)) refuse(shown, "it is a folder");
  if (!S_ISREG(status.st_mode)) refuse(shown, "it is not a regular file");
}

/// 0 or the error of flushing `path` (file or folder) to the disk.
int flush(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return errno;
  const int error = ::fsync(descriptor) == 0 ? 0 : errno;
  ::close(descriptor);
  return error;
}

/// Those of the file that is replaced; nothing for a new one, which has those of the process.
std::optional<struct stat> rightsOf(const std::string& target) {
  struct stat status {};
  if (::stat(target.c_str(), &status) != 0) return std::nullopt;
  return status;
}

/// Nobody may read or write the file who may not do so with the one that it replaces. Only root can keep the owner.
/// `more`: bits of the mode that it has as well.
void giveRights(int descriptor, const struct stat& rights, mode_t more) {
  constexpr mode_t kRights = 0777;
  struct stat own {};
  if (::fstat(descriptor, &own) != 0) return;
  const bool is_given = (own.st_uid == rights.st_uid && own.st_gid == rights.st_gid) ||
                        ::fchown(descriptor, rights.st_uid, rights.st_gid) == 0;
  const mode_t of_others = is_given ? kRights : kRights & ~static_cast<mode_t>(S_IRWXG);  // it is of another group
  ::fchmod(descriptor, ((rights.st_mode & of_others) | more) & kRights);
}

/// A new file of a name that nobody else has. Throws FileError.
int createLocked(const std::string& shown, const std::string& target, std::string& path, int& slot) {
  while (true) {
    const FileChange change;
    path = partialName(target);
    slot = enlistUnfinished(path);
    const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    const int error = errno;
    // Without locks the file is safe as well, since nobody can lock it to remove it.
    if (descriptor >= 0) ::flock(descriptor, LOCK_EX);
    if (descriptor >= 0 && isAt(descriptor, path)) return descriptor;
    if (descriptor >= 0) ::close(descriptor);  // removed before it was locked
    strikeUnfinished(slot);
    if (descriptor < 0 && error != EEXIST) refuse(shown, error);
  }
}

}  // namespace

PartialFile::PartialFile(const std::string& target) : shown_(target), target_(resolved(target)) {
  requireReplaceable(shown_, target_);
  removeAbandoned(folderOf(target_));
  locked_ = createLocked(shown_, target_, partial_, slot_);
  if (const auto rights = rightsOf(target_)) giveRights(locked_, *rights, S_IRUSR | S_IWUSR);
}

PartialFile::~PartialFile() {
  const FileChange change;
  if (!committed_) ::unlink(partial_.c_str());
  strikeUnfinished(slot_);
  ::close(locked_);
}

void PartialFile::commit() {
  if (const auto rights = rightsOf(target_)) giveRights(locked_, *rights, 0);
  if (const int error = flush(partial_)) refuse(shown_, error);
  if (std::rename(partial_.c_str(), target_.c_str()) != 0) refuse(shown_, errno);
  committed_ = true;
  // The file is in place. That its folder cannot be flushed, as on some network disks, is no failure.
  flush(folderOf(target_));
}

void PartialFile::write(const std::string& content) {
  const int descriptor = ::open(partial_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  if (descriptor < 0) refuse(shown_, errno);
  std::size_t written = 0;
  while (written < content.size()) {
    const ssize_t count = ::write(descriptor, content.data() + written, content.size() - written);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      const int error = count < 0 ? errno : ENOSPC;
      ::close(descriptor);
      refuse(shown_, error);
    }
    written += static_cast<std::size_t>(count);
  }
  if (::close(descriptor) != 0) refuse(shown_, errno);
}

OutputLock::OutputLock(const std::string& target) : path_(resolved(target) + std::string(kLockSuffix)) {
  for (int attempt = 1; !tryLock(); ++attempt) {
    if (attempt == kLockAttempts) refuse(target, "process " + holderIn(path_) + " is writing it");
    ::poll(nullptr, 0, 10);
  }
}

bool OutputLock::tryLock() {
  const FileChange change;
  locked_ = openLocked(path_, O_CREAT);
  if (locked_ < 0) {
    if (errno == EWOULDBLOCK) return false;
    if (isWithoutLocks(errno)) ::unlink(path_.c_str());  // it keeps nobody away, and nobody else would remove it
    return true;
  }
  slot_ = enlistUnfinished(path_);
  nameHolder(locked_);
  return true;
}

OutputLock::~OutputLock() {
  if (locked_ < 0) return;
  const FileChange change;
  ::unlink(path_.c_str());
  strikeUnfinished(slot_);
  ::close(locked_);
}

void writeFile(const std::string& path, const std::string& content) {
  PartialFile file(path);
  file.write(content);
  file.commit();
}

}  // namespace visual_localization

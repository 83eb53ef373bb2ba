#pragma once

#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>

namespace visual_localization {

/// A file that cannot be read or written. The text is one line and begins with the path.
class FileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A file that is being written under a temporary name beside its target. commit() puts it in the target's
/// place in one step; without it the temporary file disappears again. So the target is the old file, the new
/// one, or absent, whatever happens in between. The temporary file is locked (flock) for as long as its process lives:
/// the first PartialFile that another process makes in this folder removes those that nobody holds any more. The new
/// file has the permissions of the one it replaces.
class PartialFile {
 public:
  /// Creates `<target>.<16 random hexadecimal digits>.visual_localization.partial`, empty. Throws FileError naming
  /// `target` when its folder does not exist or cannot be written, or when the target is something else than a regular
  /// file.
  explicit PartialFile(const std::string& target);
  ~PartialFile();
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;

  /// The name to write to until commit().
  const std::string& path() const { return partial_; }

  /// Appends to the file. Throws FileError naming the target, for instance when the disk is full.
  void write(const std::string& content);

  /// Flushes the file to the disk and renames it to the target. Throws FileError naming the target.
  void commit();

 private:
  std::string shown_;   ///< the target as the caller named it
  std::string target_;  ///< with symbolic links resolved
  std::string partial_;
  int slot_ = -1;
  int locked_ = -1;  ///< descriptor
  bool committed_ = false;
};

/// Keeps other processes that ask for the same from writing a file, by the locked file
/// `<target>.lock.visual_localization.partial`. It
/// disappears with this object. What a killed process leaves behind does not hold anybody up.
class OutputLock {
 public:
  /// Waits a second for whoever holds it, then throws FileError naming `target` and that process. Where the file system
  /// has no locks nobody is kept from writing.
  explicit OutputLock(const std::string& target);
  ~OutputLock();
  OutputLock(const OutputLock&) = delete;
  OutputLock& operator=(const OutputLock&) = delete;

 private:
  /// False while another process holds it.
  bool tryLock();

  std::string path_;
  int slot_ = -1;
  int locked_ = -1;  ///< descriptor
};

/// Writes `content` to `path` as a whole or not at all. Throws FileError.
void writeFile(const std::string& path, const std::string& content);

/// For programs: removes every unfinished PartialFile when the process is ended by SIGHUP, SIGINT, SIGPIPE or
/// SIGTERM, and lets a write beyond the file size limit fail as an error instead of ending the process.
void removePartialFilesOnSignals();

/// The whole content of a file, or of a pipe, which can be read only once and into which somebody must write within 10
/// s. Throws FileError, also for a device, and when it has more than `most_bytes`: whoever knows what a file may hold
/// need not take memory for what it does.
std::string readFile(const std::string& path, std::size_t most_bytes = std::numeric_limits<std::size_t>::max());

}  // namespace visual_localization

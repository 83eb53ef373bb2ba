#pragma once

#include <string>

#include <signal.h>

namespace visual_localization {

/// While one lives, no signal ends the process: its handler waits, so that it sees every file and no entry that is half
/// there. Never one within another.
class FileChange {
 public:
  FileChange();
  ~FileChange();
  FileChange(const FileChange&) = delete;
  FileChange& operator=(const FileChange&) = delete;

 private:
  sigset_t before_{};
};

/// Within a FileChange: a file that is removed when a signal ends the process (see removePartialFilesOnSignals).
/// Returns its slot, or -1 when there is none left.
int enlistUnfinished(const std::string& path);
/// Within a FileChange: it is finished or removed.
void strikeUnfinished(int slot);

}  // namespace visual_localization

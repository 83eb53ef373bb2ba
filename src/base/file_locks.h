#pragma once

#include <string>

namespace visual_localization {

/// What stands behind the name of a file while one process at a time may write it.
constexpr const char* kLockSuffix = ".lock.partial";

/// A new name beside `target`: `<target>.<16 random hexadecimal digits>.partial`. Two processes in two containers have
/// the same number, so it is none of theirs.
std::string partialName(const std::string& target);

/// Whether the open file is the one that has this name.
bool isAt(int descriptor, const std::string& path);

/// Opens the file and locks it (flock) until the descriptor is closed or the process has ended, however. `flags`: more
/// of open(). Returns a descriptor, or -1 with errno: EWOULDBLOCK when another process holds it.
int openLocked(const std::string& path, int flags);

/// Removes the temporary files in the folder, by their names, that no living process holds. Does so once for each
/// folder; what cannot be read, locked or removed stays.
void removeAbandoned(const std::string& folder);

/// Writes this process into the file: "12 on host".
void nameHolder(int descriptor);
/// What nameHolder() wrote there.
std::string holderIn(const std::string& path);

}  // namespace visual_localization

#include "evaluation/trajectory_files.h"

#include <cstddef>
#include <filesystem>
#include <system_error>

#include "base/files.h"

namespace visual_localization {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestPart = 60;  ///< of a file name, which has at most 255 bytes

/// A name as a part of a file name.
std::string plain(std::string name) {
  const auto isPlain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '.';
  };
  for (char& c : name) c = isPlain(c) ? c : '_';
  return name.substr(0, kLongestPart);
}

}  // namespace

std::string TrajectoryFiles::nameFor(const std::string& method, const std::string& map, const std::string& drive,
                                     const std::string& start) {
  const std::string rest = "__" + plain(map) + "__" + plain(drive) + "__" + start;
  std::string name = plain(method) + rest;
  for (int count = 2; !taken_.insert(name).second; ++count) name = plain(method) + "_" + std::to_string(count) + rest;
  return name;
}

void TrajectoryFiles::write(const std::string& method, const std::string& map, const std::string& drive,
                            const UnitResult& unit) {
  if (unit.trajectory.empty()) return;
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) throw FileError(folder_ + ": cannot be created: " + error.message());
  const std::string& row = unit.trace.front();
  const std::string path = folder_ + "/" + nameFor(method, map, drive, row.substr(0, row.find(',')));
  std::string estimates;
  std::string truths;
  for (const TracedPose& pose : unit.trajectory) {
    estimates += pose.estimate + '\n';
    if (!pose.truth.empty()) truths += pose.truth + '\n';
  }
  writeFile(path + ".tum", estimates);
  if (!truths.empty()) writeFile(path + ".truth.tum", truths);
}

}  // namespace visual_localization

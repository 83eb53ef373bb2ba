/// Runs a fuzz target over the files of folders, without libFuzzer: what once went wrong must not come back. In a
/// folder `accepted` something must be read and nothing refused, and in `accepted_by_one` one reader of several must
/// read something: otherwise the target tests nothing behind the first check.
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include "test/fuzz/fuzz_support.h"
#include "test/support/temporary_folder.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace visual_localization {
namespace {

/// And below, in order.
std::vector<std::string> filesIn(const std::vector<std::string>& folders) {
  std::vector<std::string> paths;
  for (const std::string& folder : folders) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
      if (entry.is_regular_file()) paths.push_back(entry.path().string());
    }
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

void replay(const std::string& path) {
  const std::string bytes = test::readAll(path);
  const fuzz::Outcomes before = fuzz::outcomes();
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  const std::size_t read = fuzz::outcomes().read - before.read;
  const std::size_t refused = fuzz::outcomes().refused - before.refused;
  std::cout << "  " << read << " read, " << refused << " refused" << std::endl;
  const std::string why = refused > 0 ? ": " + fuzz::outcomes().refusal : "";
  const std::string folder = std::filesystem::path(path).parent_path().filename();
  if (folder == "accepted" && (read == 0 || refused > 0)) fuzz::fail("must be read as a whole, but is not" + why);
  if (folder == "accepted_by_one" && read == 0) fuzz::fail("no reader accepts it, one must" + why);
}

}  // namespace
}  // namespace visual_localization

int main(int argc, char** argv) {
  const std::vector<std::string> paths = visual_localization::filesIn({argv + 1, argv + argc});
  for (const std::string& path : paths) {
    std::cout << path << std::endl;  // flushed: the last line names the file that ended the program
    visual_localization::replay(path);
  }
  std::cout << paths.size() << " files\n";
  return paths.empty() ? 1 : 0;
}

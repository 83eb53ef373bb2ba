#include "visual_localization/io/read_file.h"

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "visual_localization/io/partial_file.h"

namespace visual_localization {
namespace {

[[noreturn]] void refuse(const std::string& path, int error) {
  throw FileError((path.empty() ? "''" : path) + ": cannot be read: " + std::strerror(error));
}

}  // namespace

std::string readFile(const std::string& path) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rbe"), std::fclose);
  if (!file) refuse(path, errno);
  std::string text;
  std::array<char, 65536> block{};
  while (const std::size_t count = std::fread(block.data(), 1, block.size(), file.get())) {
    text.append(block.data(), count);
  }
  if (std::ferror(file.get()) != 0) refuse(path, errno);  // a folder, for instance
  return text;
}

}  // namespace visual_localization

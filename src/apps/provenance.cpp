#include "apps/provenance.h"

#include <array>
#include <filesystem>

#include <pwd.h>
#include <unistd.h>

#include "base/text.h"

namespace visual_localization::apps {
namespace {

std::string user() {
  const passwd* entry = ::getpwuid(::geteuid());
  return entry == nullptr ? std::to_string(::geteuid()) : entry->pw_name;
}

std::string host() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "?";
}

}  // namespace

std::string provenance(const std::string& command, const std::vector<std::string>& from) {
  constexpr std::size_t kLongest = 4000;  // a job of a thousand maps names the first hundred
  std::vector<std::string> names;
  for (const std::string& path : from) names.push_back(std::filesystem::path(path).filename().string());
  return oneLine(command + " of " + joined(names), kLongest) + " by map_edit " + VISUAL_LOCALIZATION_VERSION + ", " +
         oneLine(user() + "@" + host());
}

}  // namespace visual_localization::apps

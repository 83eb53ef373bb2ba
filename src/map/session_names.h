#pragma once

#include <cstddef>
#include <set>
#include <string>

namespace visual_localization {

/// A name for one more session of a map: `name`, or with a number behind it if it is in use.
inline std::string unusedName(const std::string& name, const std::set<std::string>& used) {
  std::string unused = name;
  for (std::size_t n = 2; used.count(unused) != 0; ++n) unused = name + "_" + std::to_string(n);
  return unused;
}

}  // namespace visual_localization

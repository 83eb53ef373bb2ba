#pragma once

#include <cstddef>
#include <string>

namespace visual_localization {

/// Foreign text for a message of one line: control characters become spaces, and only so many characters are shown.
inline std::string oneLine(std::string text, std::size_t most = 300) {
  if (text.size() > most) text.resize(most);
  for (char& c : text) {
    if ((c >= 0 && c < 32) || c == 127) c = ' ';
  }
  return text;
}

}  // namespace visual_localization

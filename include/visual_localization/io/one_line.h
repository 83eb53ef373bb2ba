#pragma once

#include <cstddef>
#include <string>

#include "visual_localization/io/utf8.h"

namespace visual_localization {

/// Foreign text for a message of one line: control characters become spaces, and only so many bytes are shown, without
/// half a character of UTF-8 at the end.
inline std::string oneLine(std::string text, std::size_t most = 300) {
  text.resize(characterBorder(text, most));
  for (char& c : text) {
    if ((c >= 0 && c < 32) || c == 127) c = ' ';
  }
  return text;
}

}  // namespace visual_localization

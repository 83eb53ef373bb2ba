#pragma once

#include <cstddef>
#include <string>

namespace visual_localization {

/// Bytes of the character of UTF-8 that begins at `at`, which is below the size; 0 when none does: cut off, longer than
/// it need be, half of a pair or beyond the last one (RFC 3629, section 4).
std::size_t characterBytes(const std::string& text, std::size_t at);

/// Where a character ends or begins: `at`, or what is next before it when it would cut one in two. What is no UTF-8 is
/// cut anywhere.
std::size_t characterBorder(const std::string& text, std::size_t at);

/// The end of `text`, not longer than `most` bytes, without half a character at its front.
std::string lastCharacters(const std::string& text, std::size_t most);

/// Foreign text for a message of one line: control characters become spaces, and only so many bytes are shown, without
/// half a character of UTF-8 at the end.
std::string oneLine(std::string text, std::size_t most = 300);

}  // namespace visual_localization

#pragma once

#include <cstddef>
#include <iterator>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

namespace visual_localization {

/// Bytes of the character of UTF-8 that begins at `at`, which is below the size; 0 when none does: cut off, longer than
/// it need be, half of a pair or beyond the last one (RFC 3629, section 4).
std::size_t characterBytes(const std::string& text, std::size_t at);

/// Where a character ends or begins: `at`, or what is next before it when it would cut one in two. What is no UTF-8 is
/// cut anywhere.
std::size_t characterBorder(const std::string& text, std::size_t at);

/// The end of `text`, not longer than `most` bytes, without half a character at its front.
std::string lastCharacters(const std::string& text, std::size_t most);

/// Foreign text for a message of one line, on a terminal, in a log or in an answer: control characters become spaces,
/// what is no UTF-8, turns the order of the text or cannot be seen becomes '?', and only so many bytes are shown,
/// without half a character at the end.
std::string oneLine(const std::string& text, std::size_t most = 300);

/// The elements of a list of texts with `separator` between them.
template <class Texts>
std::string joined(const Texts& texts, const std::string& separator = ", ") {
  std::string all;
  for (const auto& text : texts) {
    if (&text != &*std::begin(texts)) all += separator;
    all += text;
  }
  return all;
}

/// In capital letters, those of ASCII.
std::string upperCase(std::string text);

/// Foreign text as a field of a CSV file, in quotes (RFC 4180): as oneLine() shows it, and with an apostrophe in front
/// where a spreadsheet would run it as a formula.
std::string csvQuoted(const std::string& text);

/// The same in quotes only where it needs them.
std::string csvField(const std::string& text);

/// The fields of a line of a CSV file that has no quotes.
std::vector<std::string> csvFields(const std::string& line);

/// Decimal digits with which every number reads back as the same double.
constexpr int kFullPrecision = std::numeric_limits<double>::max_digits10;

/// An empty text to write numbers into, with `digits` significant digits and a decimal point whatever the locale.
std::ostringstream numberStream(int digits = kFullPrecision);

}  // namespace visual_localization

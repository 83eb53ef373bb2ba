#include "base/text.h"

#include <algorithm>
#include <cstdint>
#include <locale>

namespace visual_localization {

std::size_t characterBytes(const std::string& text, std::size_t at) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U; };
  const unsigned first = byte(at);
  const std::size_t bytes = first < 0x80 ? 1 : first < 0xC2 ? 0 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
  if (bytes < 2) return bytes;
  if (first > 0xF4) return 0;
  const unsigned least = first == 0xE0 ? 0xA0 : first == 0xF0 ? 0x90 : 0x80;
  const unsigned most = first == 0xED ? 0x9F : first == 0xF4 ? 0x8F : 0xBF;
  if (byte(at + 1) < least || byte(at + 1) > most) return 0;
  for (std::size_t i = 2; i < bytes; ++i) {
    if (byte(at + i) < 0x80 || byte(at + i) > 0xBF) return 0;
  }
  return bytes;
}

std::size_t characterBorder(const std::string& text, std::size_t at) {
  if (at >= text.size()) return text.size();
  for (std::size_t back = 1; back < 4 && back <= at; ++back) {
    const std::size_t begin = at - back;
    if (characterBytes(text, begin) > back) return begin;
  }
  return at;
}

std::string lastCharacters(const std::string& text, std::size_t most) {
  if (text.size() <= most) return text;
  std::size_t begin = text.size() - most;
  const std::size_t border = characterBorder(text, begin);
  if (border < begin) begin = border + characterBytes(text, border);
  return text.substr(begin);
}

namespace {

/// Of the character of so many bytes that begins there.
std::uint32_t codePoint(const std::string& text, std::size_t at, std::size_t bytes) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  if (bytes == 1) return byte(at);
  std::uint32_t code = byte(at) & (0xFFU >> (bytes + 1));
  for (std::size_t i = 1; i < bytes; ++i) code = code << 6U | (byte(at + i) & 0x3FU);
  return code;
}

bool isControl(std::uint32_t code) { return code < 0x20 || (code >= 0x7F && code < 0xA0); }

/// What changes the order of the text around it, ends its line, or cannot be seen (Unicode, Cf, Zl and Zp).
bool isInvisible(std::uint32_t code) {
  return code == 0xAD || code == 0x61C || code == 0x180E || (code >= 0x200B && code <= 0x200F) ||
         (code >= 0x2028 && code <= 0x202E) || (code >= 0x2060 && code <= 0x206F) || code == 0xFEFF ||
         (code >= 0xFFF9 && code <= 0xFFFB) || (code >= 0xE0000 && code <= 0xE0FFF);
}

bool isNumber(const std::string& text) {
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  double number = 0.0;
  return static_cast<bool>(in >> number) && in.eof();
}

/// A spreadsheet runs a text that begins like this.
std::string noFormula(const std::string& text) {
  const bool runs = !text.empty() && std::string("=+-@").find(text.front()) != std::string::npos;
  return runs && !isNumber(text) ? "'" + text : text;
}

std::string csvText(const std::string& text) { return noFormula(oneLine(text, text.size())); }

std::string quoted(const std::string& text) {
  std::string all = "\"";
  for (const char c : text) all += c == '"' ? std::string("\"\"") : std::string(1, c);
  return all + '"';
}

}  // namespace

std::string oneLine(const std::string& text, std::size_t most) {
  std::string line;
  const std::size_t end = characterBorder(text, most);
  for (std::size_t at = 0; at < end;) {
    const std::size_t bytes = characterBytes(text, at);
    const std::uint32_t code = bytes == 0 ? 0 : codePoint(text, at, bytes);
    if (bytes == 0 || isInvisible(code)) {
      line += '?';
    } else if (isControl(code)) {
      line += ' ';
    } else {
      line.append(text, at, bytes);
    }
    at += std::max<std::size_t>(1, bytes);
  }
  return line;
}

std::string upperCase(std::string text) {
  for (char& character : text) {
    if (character >= 'a' && character <= 'z') character = static_cast<char>(character - 'a' + 'A');
  }
  return text;
}

std::string csvQuoted(const std::string& text) { return quoted(csvText(text)); }

std::string csvField(const std::string& text) {
  const std::string field = csvText(text);
  return field.find_first_of(",\"") == std::string::npos ? field : quoted(field);
}

std::vector<std::string> csvFields(const std::string& line) {
  std::vector<std::string> fields(1);
  for (const char c : line) {
    if (c == ',') {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  return fields;
}

std::ostringstream numberStream(int digits) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(digits);
  return out;
}

}  // namespace visual_localization

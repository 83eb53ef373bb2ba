#include "base/text.h"

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

std::string oneLine(std::string text, std::size_t most) {
  text.resize(characterBorder(text, most));
  for (char& c : text) {
    if ((c >= 0 && c < 32) || c == 127) c = ' ';
  }
  return text;
}

std::string csvQuoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

std::string csvField(const std::string& text) {
  return text.find_first_of(",\"\n") == std::string::npos ? text : csvQuoted(text);
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

#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <iostream>
#include <string>
#include <type_traits>

#include <fcntl.h>
#include <unistd.h>

#include "base/text.h"

namespace visual_localization::fuzz {

/// Ends the program, as a sanitizer does: libFuzzer then keeps the input.
[[noreturn]] inline void fail(const std::string& why) {
  std::cerr << why << std::endl;
  std::abort();
}

/// What is refused is refused in one line that a terminal shows as it is.
inline void requireOneLine(const std::string& text) {
  if (text.empty()) fail("a refusal says nothing");
  if (text.size() > 20000) fail("a refusal of " + std::to_string(text.size()) + " characters");
  if (oneLine(text, text.size()) != text) fail("a refusal that is no plain line: " + text);
}

/// What a target has done so far; replay.cpp compares.
struct Outcomes {
  std::size_t read = 0;     ///< parts of inputs that the target could make something of
  std::size_t refused = 0;  ///< by expect()
  std::string refusal;      ///< the last one
};
inline Outcomes& outcomes() {
  static Outcomes so_far;
  return so_far;
}

inline void countRead() { ++outcomes().read; }

/// What was accepted must not be refused by what follows.
template <class Then>
void mustNotThrow(Then then) {
  try {
    then();
  } catch (const std::exception& error) {
    fail(std::string("accepted, and refused afterwards: ") + error.what());
  }
}

/// Runs `read`. It may refuse its input by throwing a `Refusal`, and in no other way.
template <class Refusal, class Read>
bool expect(Read read) {
  try {
    read();
    return true;
  } catch (const Refusal& refusal) {
    ++outcomes().refused;
    outcomes().refusal = refusal.what();
    requireOneLine(refusal.what());
    return false;
  }
}

/// Takes values from the bytes of an input, one after the other; zeros when they are used up.
class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}

  template <class Number>
  Number number() {
    static_assert(std::is_arithmetic_v<Number>);
    Number value{};
    const std::size_t count = std::min(sizeof(value), size_);
    if (count > 0) std::memcpy(&value, data_, count);
    skip(count);
    return value;
  }

  /// Of at most 255 characters.
  std::string text() {
    const std::size_t count = std::min<std::size_t>(number<std::uint8_t>(), size_);
    const std::string text(reinterpret_cast<const char*>(data_), count);
    skip(count);
    return text;
  }

  std::string rest() const { return std::string(reinterpret_cast<const char*>(data_), size_); }
  bool isEmpty() const { return size_ == 0; }

 private:
  void skip(std::size_t count) {
    data_ += count;
    size_ -= count;
  }

  const std::uint8_t* data_;
  std::size_t size_;
};

/// The bytes as a file, the same one every time; removed at the end of the program.
inline std::string inMemoryFile(const std::uint8_t* data, std::size_t size) {
  struct File {
    File() {
      const char* const memory = "/dev/shm";
      const auto folder = std::filesystem::is_directory(memory) ? std::filesystem::path(memory)
                                                                : std::filesystem::temp_directory_path();
      path = (folder / ("visual_localization_fuzz_" + std::to_string(::getpid()))).string();
      descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    }
    ~File() {
      ::close(descriptor);
      ::unlink(path.c_str());
    }
    File(const File&) = delete;
    File& operator=(const File&) = delete;
    std::string path;
    int descriptor;
  };
  static const File file;
  const auto wanted = static_cast<ssize_t>(size);
  if (::ftruncate(file.descriptor, wanted) != 0 || ::pwrite(file.descriptor, data, size, 0) != wanted) {
    fail("cannot write " + file.path);
  }
  return file.path;
}

}  // namespace visual_localization::fuzz

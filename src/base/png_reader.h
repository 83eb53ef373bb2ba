#pragma once

#include <csetjmp>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <png.h>

namespace visual_localization {

/// libpng decoding an image in memory to grey. It reports errors by a jump, so functions that call it have no objects
/// of their own. Not its simplified interface, which keeps all texts of a file, gigabytes from a few megabytes, and
/// corrects gamma; nor OpenCV, which keeps them too.
class PngReader {
 public:
  /// Nothing larger than `most_side_px` a side is read. `data` must outlive it.
  PngReader(const std::uint8_t* data, std::size_t size, std::uint32_t most_side_px);
  ~PngReader();
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  /// Once, before anything else. False when broken or too large.
  bool readHeader();

  std::uint64_t width() const { return ::png_get_image_width(png_, info_); }
  std::uint64_t height() const { return ::png_get_image_height(png_, info_); }
  /// Of a channel.
  int bits() const { return ::png_get_bit_depth(png_, info_); }
  bool isGrey() const { return ::png_get_color_type(png_, info_) == PNG_COLOR_TYPE_GRAY; }
  bool isTransparent() const { return ::png_get_valid(png_, info_, PNG_INFO_tRNS) != 0; }

  /// Once: to grey of one byte a pixel or, of an image of 16 bits, of `bytes` 2. False when broken, the end too.
  bool read(std::vector<png_bytep>& rows, int bytes);

 private:
  void copyNext(png_structp png, png_bytep to, std::size_t count);
  void convertToGrey(int bytes);

  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t at_ = 0;
  std::uint32_t most_side_px_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  std::jmp_buf refused_{};
};

}  // namespace visual_localization

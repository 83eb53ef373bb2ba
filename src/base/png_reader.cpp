#include "base/png_reader.h"

#include <cstring>

namespace visual_localization {
namespace {

PngReader& readerOf(void* reader) { return *static_cast<PngReader*>(reader); }

}  // namespace

PngReader::PngReader(const std::uint8_t* data, std::size_t size, std::uint32_t most_side_px)
    : data_(data), size_(size), most_side_px_(most_side_px) {
  png_ = ::png_create_read_struct(
      PNG_LIBPNG_VER_STRING, this,
      [](png_structp png, png_const_charp) { std::longjmp(readerOf(::png_get_error_ptr(png)).refused_, 1); },
      [](png_structp, png_const_charp) {});
  if (png_ != nullptr) info_ = ::png_create_info_struct(png_);
}

PngReader::~PngReader() { ::png_destroy_read_struct(&png_, &info_, nullptr); }

bool PngReader::readHeader() {
  static const png_byte kTexts[] = "tEXt\0zTXt\0iTXt\0sPLT\0eXIf";
  if (info_ == nullptr || setjmp(refused_) != 0) return false;
  ::png_set_read_fn(png_, this, [](png_structp png, png_bytep to, std::size_t count) {
    readerOf(::png_get_io_ptr(png)).copyNext(png, to, count);
  });
  ::png_set_user_limits(png_, most_side_px_, most_side_px_);
  ::png_set_keep_unknown_chunks(png_, PNG_HANDLE_CHUNK_NEVER, kTexts, 5);
  // A wrong checksum must not hide transparency.
  ::png_set_crc_action(png_, PNG_CRC_DEFAULT, PNG_CRC_QUIET_USE);
  ::png_read_info(png_, info_);
  return true;
}

bool PngReader::read(std::vector<png_bytep>& rows, int bytes) {
  if (setjmp(refused_) != 0) return false;
  convertToGrey(bytes);
  if (::png_get_rowbytes(png_, info_) != static_cast<std::uint64_t>(bytes) * width()) return false;
  ::png_read_image(png_, rows.data());
  ::png_read_end(png_, nullptr);
  return true;
}

void PngReader::copyNext(png_structp png, png_bytep to, std::size_t count) {
  if (count > size_ - at_) ::png_error(png, "cut off");
  std::memcpy(to, data_ + at_, count);
  at_ += count;
}

/// As OpenCV does, with its weights of red and green.
void PngReader::convertToGrey(int bytes) {
  const std::uint16_t one = 1;
  const bool low_byte_first = *reinterpret_cast<const std::uint8_t*>(&one) == 1;
  const int colour = ::png_get_color_type(png_, info_);
  if (bytes == 1) ::png_set_strip_16(png_);
  if (bytes == 2 && low_byte_first) ::png_set_swap(png_);
  ::png_set_strip_alpha(png_);
  if (colour == PNG_COLOR_TYPE_PALETTE) ::png_set_palette_to_rgb(png_);
  if ((colour & PNG_COLOR_MASK_COLOR) == 0) ::png_set_expand_gray_1_2_4_to_8(png_);
  ::png_set_rgb_to_gray(png_, PNG_ERROR_ACTION_NONE, 0.299, 0.587);
  ::png_set_interlace_handling(png_);
  ::png_read_update_info(png_, info_);
}

}  // namespace visual_localization

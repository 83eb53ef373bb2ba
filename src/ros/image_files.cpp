#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <initializer_list>
#include <string>
#include <vector>

#include <jerror.h>
#include <jpeglib.h>
#include <png.h>

#include "ros/image_depth.h"
#include "visual_localization/ros/image_conversion.h"

// libjpeg and libpng themselves, whose only way to report an error is a jump. OpenCV 4.6 takes 346 of 348 cut-off JPEGs
// for whole, and 378 MiB for a PNG of 0.44 MB with compressed texts. TurboJPEG's limit of scans is newer than Debian
// 11, and stray bytes within a JPEG look to it like a cut-off one. libpng's simplified interface reads the texts too,
// and corrects gamma, so that its greys are not those of OpenCV.
namespace visual_localization {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// Each scan of a progressive JPEG goes over all its pixels; encoders write about ten of them.
constexpr int kMaxJpegScans = 100;

bool startsWith(const Bytes& data, std::initializer_list<std::uint8_t> magic) {
  return data.size() >= magic.size() && std::equal(magic.begin(), magic.end(), data.begin());
}

/// libjpeg reading an image. It reports errors by a jump, so functions that call it have no objects of their own.
class JpegReader {
 public:
  JpegReader() {
    decoder_.err = ::jpeg_std_error(&errors_);
    decoder_.client_data = this;
    errors_.error_exit = [](j_common_ptr decoder) { std::longjmp(of(decoder).refused_, 1); };
    errors_.emit_message = [](j_common_ptr decoder, int level) {
      // The decoder fills what is missing with grey and calls it a success.
      if (level < 0 && decoder->err->msg_code == JWRN_JPEG_EOF) of(decoder).cut_off_ = true;
    };
  }
  ~JpegReader() { ::jpeg_destroy_decompress(&decoder_); }
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;

  /// False when broken.
  bool readHeader(const Bytes& data) {
    if (setjmp(refused_) != 0) return false;
    jpeg_create_decompress(&decoder_);
    ::jpeg_mem_src(&decoder_, data.data(), static_cast<unsigned long>(data.size()));
    return ::jpeg_read_header(&decoder_, TRUE) == JPEG_HEADER_OK;
  }

  /// False when broken or with more than kMaxJpegScans.
  bool hasFewScans() {
    if (setjmp(refused_) != 0) return false;
    if (::jpeg_has_multiple_scans(&decoder_) == FALSE) return true;
    decoder_.buffered_image = TRUE;
    ::jpeg_start_decompress(&decoder_);
    while (decoder_.input_scan_number <= kMaxJpegScans) {
      const int progress = ::jpeg_consume_input(&decoder_);
      if (progress == JPEG_REACHED_EOI || progress == JPEG_SUSPENDED) return true;
    }
    return false;
  }

  /// False when broken. Whatever stands behind the decoder's own end is not looked at.
  bool read(std::vector<JSAMPROW>& rows) {
    if (setjmp(refused_) != 0) return false;
    decoder_.out_color_space = JCS_GRAYSCALE;
    ::jpeg_start_decompress(&decoder_);
    while (decoder_.output_scanline < decoder_.output_height) {
      ::jpeg_read_scanlines(&decoder_, &rows[decoder_.output_scanline],
                            decoder_.output_height - decoder_.output_scanline);
    }
    return ::jpeg_finish_decompress(&decoder_) == TRUE;
  }

  std::uint64_t width() const { return decoder_.image_width; }
  std::uint64_t height() const { return decoder_.image_height; }
  bool isCutOff() const { return cut_off_; }

 private:
  static JpegReader& of(j_common_ptr decoder) { return *static_cast<JpegReader*>(decoder->client_data); }

  jpeg_decompress_struct decoder_{};
  jpeg_error_mgr errors_{};
  bool cut_off_ = false;
  std::jmp_buf refused_{};
};

cv::Size sizeFrom(JpegReader& reader, const Bytes& data) {
  const bool read = reader.readHeader(data);
  if (reader.isCutOff()) throw ImageError("JPEG is cut off");
  if (!read) throw ImageError("JPEG is broken");
  return requireImageSize(reader.width(), reader.height());
}

std::vector<std::uint8_t*> imageRows(cv::Mat& image) {
  std::vector<std::uint8_t*> rows;
  for (int row = 0; row < image.rows; ++row) rows.push_back(image.ptr(row));
  return rows;
}

cv::Mat greyOfJpeg(const Bytes& data) {
  {
    JpegReader reader;
    sizeFrom(reader, data);
    if (!reader.hasFewScans()) {
      throw ImageError("JPEG is broken or has more than " + std::to_string(kMaxJpegScans) + " scans");
    }
  }
  JpegReader reader;
  cv::Mat grey(sizeFrom(reader, data), CV_8UC1);
  std::vector<std::uint8_t*> rows = imageRows(grey);
  const bool read = reader.read(rows);
  if (reader.isCutOff()) throw ImageError("JPEG is cut off");
  if (!read) throw ImageError("JPEG is broken, or its colours are neither grey, YCbCr nor RGB");
  return grey;
}

/// libpng decoding an image to grey. It reports errors by a jump, so functions that call it have no objects of their
/// own. OpenCV's decoder lets it decompress and keep all texts in the file: gigabytes from a few megabytes.
class PngReader {
 public:
  explicit PngReader(const Bytes& data) : data_(data) {
    png_ = ::png_create_read_struct(
        PNG_LIBPNG_VER_STRING, this,
        [](png_structp png, png_const_charp) { std::longjmp(of(::png_get_error_ptr(png)).refused_, 1); },
        [](png_structp, png_const_charp) {});
    if (png_ != nullptr) info_ = ::png_create_info_struct(png_);
  }
  ~PngReader() { ::png_destroy_read_struct(&png_, &info_, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  /// False when broken.
  bool readHeader() {
    if (info_ == nullptr || setjmp(refused_) != 0) return false;
    ::png_set_read_fn(png_, this, [](png_structp png, png_bytep to, std::size_t count) {
      of(::png_get_io_ptr(png)).read(png, to, count);
    });
    ::png_set_user_limits(png_, kMaxImageSide_px, kMaxImageSide_px);
    skipTexts();
    ::png_read_info(png_, info_);
    return true;
  }

  std::uint64_t width() const { return ::png_get_image_width(png_, info_); }
  std::uint64_t height() const { return ::png_get_image_height(png_, info_); }

  /// Bytes of a grey pixel: those of colours have one.
  int pixelBytes() const {
    return ::png_get_color_type(png_, info_) == PNG_COLOR_TYPE_GRAY && ::png_get_bit_depth(png_, info_) == 16 ? 2 : 1;
  }

  /// False when broken. `rows`: of pixelBytes() a pixel.
  bool read(std::vector<png_bytep>& rows) {
    if (setjmp(refused_) != 0) return false;
    const auto bytes = static_cast<std::uint64_t>(pixelBytes());
    bytes == 2 ? keepSixteenBits() : convertToGrey();
    if (::png_get_rowbytes(png_, info_) != bytes * width()) return false;
    ::png_read_image(png_, rows.data());
    ::png_read_end(png_, nullptr);
    return true;
  }

 private:
  static PngReader& of(void* reader) { return *static_cast<PngReader*>(reader); }

  void read(png_structp png, png_bytep to, std::size_t count) {
    if (count > data_.size() - at_) ::png_error(png, "cut off");
    std::memcpy(to, data_.data() + at_, count);
    at_ += count;
  }

  void skipTexts() {
    static const png_byte kTexts[] = "tEXt\0zTXt\0iTXt\0sPLT\0eXIf";
    ::png_set_keep_unknown_chunks(png_, PNG_HANDLE_CHUNK_NEVER, kTexts, 5);
  }

  void keepSixteenBits() {
    const std::uint16_t one = 1;
    const bool low_byte_first = *reinterpret_cast<const std::uint8_t*>(&one) == 1;
    if (low_byte_first) ::png_set_swap(png_);
    ::png_set_interlace_handling(png_);
    ::png_read_update_info(png_, info_);
  }

  /// As OpenCV does, with its weights of red and green.
  void convertToGrey() {
    const int colour = ::png_get_color_type(png_, info_);
    ::png_set_strip_16(png_);
    ::png_set_strip_alpha(png_);
    if (colour == PNG_COLOR_TYPE_PALETTE) ::png_set_palette_to_rgb(png_);
    if ((colour & PNG_COLOR_MASK_COLOR) == 0) ::png_set_expand_gray_1_2_4_to_8(png_);
    ::png_set_rgb_to_gray(png_, PNG_ERROR_ACTION_NONE, 0.299, 0.587);
    ::png_set_interlace_handling(png_);
    ::png_read_update_info(png_, info_);
  }

  const Bytes& data_;
  std::size_t at_ = 0;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  std::jmp_buf refused_{};
};

cv::Size sizeFrom(PngReader& reader) {
  if (!reader.readHeader())
    throw ImageError("PNG is broken or larger than " + std::to_string(kMaxImageSide_px) + " pixels a side");
  return requireImageSize(reader.width(), reader.height());
}

cv::Mat greyOfPng(const Bytes& data) {
  PngReader reader(data);
  const cv::Size size = sizeFrom(reader);
  cv::Mat grey(size, reader.pixelBytes() == 2 ? CV_16UC1 : CV_8UC1);
  std::vector<std::uint8_t*> rows = imageRows(grey);
  if (!reader.read(rows)) throw ImageError("PNG is broken");
  return inEightBits(grey, true);
}

bool isJpeg(const Bytes& file) { return startsWith(file, {0xFF, 0xD8, 0xFF}); }

/// Throws ImageError.
void requireKnown(const Bytes& file) {
  if (file.empty()) throw ImageError("compressed image is empty");
  if (isJpeg(file) || startsWith(file, {0x89, 'P', 'N', 'G', 0x0D, 0x0A, 0x1A, 0x0A})) return;
  throw ImageError("compressed image is neither JPEG nor PNG");
}

}  // namespace

cv::Mat decodedToGrey(const Bytes& file) {
  requireKnown(file);
  return isJpeg(file) ? greyOfJpeg(file) : greyOfPng(file);
}

cv::Size compressedSize(const Bytes& file) {
  requireKnown(file);
  if (isJpeg(file)) {
    JpegReader reader;
    return sizeFrom(reader, file);
  }
  PngReader reader(file);
  return sizeFrom(reader);
}

}  // namespace visual_localization

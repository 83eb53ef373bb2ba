#include <algorithm>
#include <csetjmp>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

#include <jerror.h>
#include <jpeglib.h>

#include "base/png_reader.h"
#include "ros/image_depth.h"
#include "visual_localization/ros/image_conversion.h"

// libjpeg itself, whose only way to report an error is a jump; PngReader likewise. OpenCV 4.6 takes 346 of 348 cut-off
// JPEGs for whole, and 378 MiB for a PNG of 0.44 MB with compressed texts. TurboJPEG's limit of scans is newer than
// Debian 11, and stray bytes within a JPEG look to it like a cut-off one.
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

cv::Size sizeFrom(PngReader& reader) {
  if (!reader.readHeader())
    throw ImageError("PNG is broken or larger than " + std::to_string(kMaxImageSide_px) + " pixels a side");
  return requireImageSize(reader.width(), reader.height());
}

cv::Mat pixelsOf(PngReader& reader, const cv::Size& size, int bytes) {
  cv::Mat grey(size, bytes == 2 ? CV_16UC1 : CV_8UC1);
  std::vector<std::uint8_t*> rows = imageRows(grey);
  if (!reader.read(rows, bytes)) throw ImageError("PNG is broken");
  return grey;
}

cv::Mat greyOfPng(const Bytes& data) {
  PngReader reader(data.data(), data.size(), kMaxImageSide_px);
  const cv::Size size = sizeFrom(reader);
  const cv::Mat grey = pixelsOf(reader, size, reader.bits() == 16 ? 2 : 1);
  const bool needs_all_bits = grey.depth() == CV_16U && fullScaleOf(grey) == 65535.0;
  if (reader.isGrey() || !needs_all_bits) return inEightBits(grey, true);
  PngReader again(data.data(), data.size(), kMaxImageSide_px);  // OpenCV cuts colours before it mixes them
  return pixelsOf(again, sizeFrom(again), 1);
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
  PngReader reader(file.data(), file.size(), kMaxImageSide_px);
  return sizeFrom(reader);
}

}  // namespace visual_localization

#include "visual_localization/ros/image_conversion.h"

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include <cv_bridge/cv_bridge.h>
#include <jpeglib.h>
#include <opencv2/imgcodecs.hpp>
#include <png.h>

#include "base/text.h"
#include "features/image_size.h"

namespace visual_localization {
namespace {

/// The size itself. Throws ImageError when an image of this size, pixels, is empty or too large to be taken.
cv::Size requireImageSize(std::uint64_t width, std::uint64_t height) {
  if (width == 0 || height == 0) {
    throw ImageError("image is empty (" + std::to_string(width) + "x" + std::to_string(height) + ")");
  }
  if (const auto reason = whyTooLarge(width, height)) throw ImageError("image is too large: " + *reason);
  return {static_cast<int>(width), static_cast<int>(height)};
}

using Bytes = std::vector<std::uint8_t>;

/// Each scan of a progressive JPEG goes over all its pixels and may take ten bytes; encoders write about ten of them.
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
    errors_.error_exit = [](j_common_ptr decoder) {
      std::longjmp(static_cast<JpegReader*>(decoder->client_data)->refused_, 1);
    };
    errors_.output_message = [](j_common_ptr) {};
  }
  ~JpegReader() { ::jpeg_destroy_decompress(&decoder_); }
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;

  /// False when it is broken.
  bool readHeader(const Bytes& data) {
    if (setjmp(refused_) != 0) return false;
    jpeg_create_decompress(&decoder_);
    ::jpeg_mem_src(&decoder_, data.data(), static_cast<unsigned long>(data.size()));
    return ::jpeg_read_header(&decoder_, TRUE) == JPEG_HEADER_OK;
  }

  /// False when it is broken or has more than kMaxJpegScans.
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

  std::uint64_t width() const { return decoder_.image_width; }
  std::uint64_t height() const { return decoder_.image_height; }

 private:
  jpeg_decompress_struct decoder_{};
  jpeg_error_mgr errors_{};
  std::jmp_buf refused_{};
};

/// The decoder fills what is missing of a JPEG with grey and calls it a success.
void requireJpegEnd(const Bytes& data) {
  std::size_t end = data.size();
  while (end > 2 && data[end - 1] == 0) --end;  // some cameras pad
  if (data[end - 2] != 0xFF || data[end - 1] != 0xD9) throw ImageError("JPEG is cut off");
}

cv::Size sizeFrom(JpegReader& reader, const Bytes& data) {
  requireJpegEnd(data);
  if (!reader.readHeader(data)) throw ImageError("JPEG is broken");
  return requireImageSize(reader.width(), reader.height());
}

cv::Mat greyOfJpeg(const Bytes& data) {
  {
    JpegReader reader;
    sizeFrom(reader, data);
    if (!reader.hasFewScans()) {
      throw ImageError("JPEG is broken or has more than " + std::to_string(kMaxJpegScans) + " scans");
    }
  }
  try {
    cv::Mat grey = cv::imdecode(data, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
    if (grey.empty() || grey.type() != CV_8UC1) throw ImageError("JPEG is broken");
    return grey;
  } catch (const cv::Exception& error) {
    throw ImageError("JPEG is broken: " + error.err);
  }
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

  /// False when it is broken.
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

  /// False when it is broken. `rows`: of its size.
  bool read(std::vector<png_bytep>& rows) {
    if (setjmp(refused_) != 0) return false;
    convertToGrey();
    if (::png_get_rowbytes(png_, info_) != width()) return false;
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
  cv::Mat grey(sizeFrom(reader), CV_8UC1);
  std::vector<png_bytep> rows;
  for (int row = 0; row < grey.rows; ++row) rows.push_back(grey.ptr(row));
  if (!reader.read(rows)) throw ImageError("PNG is broken");
  return grey;
}

bool isJpeg(const Bytes& file) { return startsWith(file, {0xFF, 0xD8, 0xFF}); }

/// Throws ImageError for anything that is neither a JPEG nor a PNG.
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

namespace {

struct Encoding {
  const char* name;
  std::uint64_t bytes_per_pixel;
};

constexpr std::array<Encoding, 10> kEncodings{{{"mono8", 1},
                                               {"mono16", 2},
                                               {"bgr8", 3},
                                               {"rgb8", 3},
                                               {"bgra8", 4},
                                               {"rgba8", 4},
                                               {"bayer_rggb8", 1},
                                               {"bayer_bggr8", 1},
                                               {"bayer_gbrg8", 1},
                                               {"bayer_grbg8", 1}}};

/// Foreign text for a one-line message: short and printable.
std::string printable(const std::string& text) {
  std::string shown = text.substr(0, 40);
  std::replace_if(
      shown.begin(), shown.end(), [](char c) { return c < 32 || c > 126; }, '?');
  return "'" + shown + "'";
}

const Encoding& encodingOf(const std::string& name) {
  const auto* found =
      std::find_if(kEncodings.begin(), kEncodings.end(), [&name](const Encoding& known) { return name == known.name; });
  if (found != kEncodings.end()) return *found;
  std::vector<std::string> names;
  for (const Encoding& known : kEncodings) names.emplace_back(known.name);
  throw ImageError("image encoding " + printable(name) + " is not supported; supported are " + joined(names));
}

void requireConsistent(const sensor_msgs::Image& message) {
  const Encoding& encoding = encodingOf(message.encoding);
  requireImageSize(message.width, message.height);
  const std::uint64_t row_bytes = message.width * encoding.bytes_per_pixel;
  if (message.step < row_bytes) {
    throw ImageError("image step is " + std::to_string(message.step) + " bytes, a row needs " +
                     std::to_string(row_bytes));
  }
  const std::uint64_t bytes = std::uint64_t{message.step} * message.height;
  if (message.data.size() != bytes) {
    throw ImageError("image data has " + std::to_string(message.data.size()) + " bytes, step x height is " +
                     std::to_string(bytes));
  }
}

bool hasSwappedBytes(const sensor_msgs::Image& message) {
  return message.is_bigendian != 0 && message.encoding == "mono16";
}

/// cv_bridge makes another kind of image when it swaps bytes itself.
sensor_msgs::Image withBytesSwapped(sensor_msgs::Image message) {
  for (std::size_t row = 0; row < message.data.size(); row += message.step) {
    for (std::size_t at = row; at < row + 2 * std::size_t{message.width}; at += 2) {
      std::swap(message.data[at], message.data[at + 1]);
    }
  }
  message.is_bigendian = 0;
  return message;
}

}  // namespace

cv::Size sizeOf(const sensor_msgs::Image& message) {
  requireConsistent(message);
  return {static_cast<int>(message.width), static_cast<int>(message.height)};
}

cv::Size sizeOf(const sensor_msgs::CompressedImage& message) { return compressedSize(message.data); }

cv::Mat toGrey(const sensor_msgs::Image& message) {
  requireConsistent(message);
  if (hasSwappedBytes(message)) return toGrey(withBytesSwapped(message));
  try {
    return cv_bridge::toCvCopy(message, "mono8")->image;
  } catch (const cv_bridge::Exception& error) {
    throw ImageError("image cannot be converted: " + std::string(error.what()));
  } catch (const cv::Exception& error) {
    throw ImageError("image cannot be converted: " + error.err);
  }
}

cv::Mat toGrey(const sensor_msgs::CompressedImage& message) { return decodedToGrey(message.data); }

}  // namespace visual_localization

#include "map/extraction_pool.h"

#include <algorithm>
#include <cmath>
#include <csetjmp>
#include <cstdio>
#include <new>
#include <utility>

#include <jpeglib.h>

#include "base/numbers.h"
#include "base/parallel.h"
#include "visual_localization/features/front_end.h"

namespace visual_localization {
namespace {

constexpr std::size_t kNeighbours = 2;  ///< Weiss et al., section III

/// libjpeg writing an image. It reports errors by a jump, so functions that call it have no objects of their own.
class JpegWriter {
 public:
  /// `grey`: 8-bit, one channel, 1 to JPEG_MAX_DIMENSION pixels a side.
  explicit JpegWriter(const cv::Mat& grey)
      : grey_(grey), bytes_(kFrame_bytes + 2 * kBlock_px * kBlock_px * blocks(grey.cols) * blocks(grey.rows)) {
    encoder_.err = ::jpeg_std_error(&errors_);
    encoder_.client_data = this;
    errors_.error_exit = [](j_common_ptr encoder) {
      std::longjmp(static_cast<JpegWriter*>(encoder->client_data)->failed_, 1);
    };
    errors_.output_message = [](j_common_ptr) {};
  }
  ~JpegWriter() { ::jpeg_destroy_compress(&encoder_); }
  JpegWriter(const JpegWriter&) = delete;
  JpegWriter& operator=(const JpegWriter&) = delete;

  /// Once. Throws std::bad_alloc.
  std::vector<std::uint8_t> write(int quality) {
    unsigned char* begin = bytes_.data();
    unsigned long size = bytes_.size();
    if (!compress(quality, begin, size) || begin != bytes_.data()) throw std::bad_alloc();
    bytes_.resize(size);
    return std::move(bytes_);
  }

 private:
  /// As much as libjpeg-turbo's tjBufSize reckons for the worst image, so that libjpeg takes no buffer of its own.
  static constexpr std::size_t kFrame_bytes = 2048;
  static constexpr std::size_t kBlock_px = 8;
  static std::size_t blocks(int side_px) { return (static_cast<std::size_t>(side_px) + kBlock_px - 1) / kBlock_px; }

  bool compress(int quality, unsigned char*& begin, unsigned long& size) {
    if (setjmp(failed_) != 0) return false;
    jpeg_create_compress(&encoder_);
    ::jpeg_mem_dest(&encoder_, &begin, &size);
    encoder_.image_width = static_cast<JDIMENSION>(grey_.cols);
    encoder_.image_height = static_cast<JDIMENSION>(grey_.rows);
    encoder_.input_components = 1;
    encoder_.in_color_space = JCS_GRAYSCALE;
    ::jpeg_set_defaults(&encoder_);
    ::jpeg_set_quality(&encoder_, quality, TRUE);
    ::jpeg_start_compress(&encoder_, TRUE);
    while (encoder_.next_scanline < encoder_.image_height) {
      auto* row = const_cast<JSAMPROW>(grey_.ptr(static_cast<int>(encoder_.next_scanline)));  // only read
      ::jpeg_write_scanlines(&encoder_, &row, 1);
    }
    ::jpeg_finish_compress(&encoder_);
    return true;
  }

  const cv::Mat& grey_;
  std::vector<std::uint8_t> bytes_;
  jpeg_compress_struct encoder_{};
  jpeg_error_mgr errors_{};
  std::jmp_buf failed_{};
};

std::vector<std::uint8_t> previewOf(const cv::Mat& grey, int width_px) {
  constexpr int kPreviewQuality = 70;
  if (width_px <= 0) return {};
  const long height_px = std::lround(1.0 * grey.rows * width_px / grey.cols);
  cv::Mat small;
  const cv::Size size(width_px, static_cast<int>(std::clamp(height_px, 1L, static_cast<long>(JPEG_MAX_DIMENSION))));
  return JpegWriter(fitted(grey, size, small)).write(kPreviewQuality);
}

}  // namespace

PruningNeighbours::PruningNeighbours(const TrainingMap& map) : map_(map), sessions_(map) {}

std::vector<std::size_t> PruningNeighbours::of(std::size_t image) const {
  const auto facesAlike = [&](std::size_t other) {
    return other != image && faceAlike(map_.yaw_rad(image), map_.yaw_rad(other));
  };
  std::vector<Neighbour> found;
  sessions_.nearest(static_cast<std::size_t>(map_.pose(image).session), map_.position_m(image),
                    {kNeighbours, kNeighbours + 1}, facesAlike, found);
  std::vector<std::size_t> neighbours;
  for (const Neighbour& neighbour : found) {
    if (neighbours.size() < kNeighbours) neighbours.push_back(neighbour.image);
  }
  return neighbours;
}

ExtractionPool::ExtractionPool(const LocalFeatureKind& kind, const ExtractorChoice& choice, int preview_width_px,
                               std::size_t threads)
    : preview_width_px_(preview_width_px), workers_(std::max<std::size_t>(1, threads)) {
  for (Worker& worker : workers_) worker.local = kind.makeExtractor(choice);
}

ExtractionPool::~ExtractionPool() = default;

TrainingImage ExtractionPool::extract(const RawImage& image, Worker& worker) const {
  const GreyLevels levels =
      greyLevelsOf(image.grey, image.mask);  // named: GCC 13 and later take the result for a part of it
  const cv::Mat& grey = withUsualContrast(image.grey, levels, worker.spread);
  LocalFeatures features = worker.local->extract(grey);
  dropMasked(image.mask, features);
  return {image.pose, std::move(features), worker.global.extract(withoutMasked(grey, image.mask, worker.masked)),
          previewOf(image.grey, preview_width_px_)};
}

std::vector<TrainingImage> ExtractionPool::extract(const std::vector<RawImage>& images) {
  std::vector<TrainingImage> extracted(images.size());
  parallelFor(images.size(), workers_.size(),
              [&](std::size_t i, std::size_t worker) { extracted[i] = extract(images[i], workers_[worker]); });
  return extracted;
}

}  // namespace visual_localization

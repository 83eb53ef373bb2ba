#include "map/extraction_pool.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <new>
#include <utility>

#include <turbojpeg.h>

#include "base/numbers.h"
#include "base/parallel.h"
#include "visual_localization/features/front_end.h"

namespace visual_localization {
namespace {

constexpr std::size_t kNeighbours = 2;  ///< Weiss et al., section III

constexpr long kMostSide_px = 65500;  ///< of a JPEG, for libjpeg

/// The same bytes as by libjpeg with its own settings. OpenCV would do, but its codecs load GDAL with every program.
/// `grey`: 8-bit, one channel. Throws std::bad_alloc.
std::vector<std::uint8_t> jpegOf(const cv::Mat& grey, int quality) {
  const std::unique_ptr<void, int (*)(tjhandle)> encoder(::tjInitCompress(), ::tjDestroy);
  if (encoder == nullptr) throw std::bad_alloc();
  std::vector<std::uint8_t> bytes(::tjBufSize(grey.cols, grey.rows, TJSAMP_GRAY));
  unsigned char* begin = bytes.data();
  unsigned long size = bytes.size();
  constexpr int kFlags = TJFLAG_NOREALLOC | TJFLAG_ACCURATEDCT;
  if (::tjCompress2(encoder.get(), grey.data, grey.cols, static_cast<int>(grey.step), grey.rows, TJPF_GRAY, &begin,
                    &size, TJSAMP_GRAY, quality, kFlags) != 0) {
    throw std::bad_alloc();  // the only error that such an image leaves
  }
  bytes.resize(size);
  return bytes;
}

std::vector<std::uint8_t> previewOf(const cv::Mat& grey) {
  constexpr int kPreviewQuality = 70;
  constexpr int kWidth_px = 80;  // enough to recognise a place on a plot
  const long height_px = std::lround(1.0 * grey.rows * kWidth_px / grey.cols);
  cv::Mat small;
  const cv::Size size(kWidth_px, static_cast<int>(std::clamp(height_px, 1L, kMostSide_px)));
  return jpegOf(fitted(grey, size, small), kPreviewQuality);
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

ExtractionPool::ExtractionPool(const LocalFeatureKind& kind, const std::string& model, std::size_t threads)
    : workers_(std::max<std::size_t>(1, threads)) {
  for (Worker& worker : workers_) worker.local = kind.makeExtractor(model);
}

ExtractionPool::~ExtractionPool() = default;

TrainingImage ExtractionPool::extract(const RawImage& image, Worker& worker) const {
  const GreyLevels levels =
      greyLevelsOf(image.grey, image.mask);  // named: GCC 13 and later take the result for a part of it
  const cv::Mat& grey = withUsualContrast(image.grey, levels, worker.spread);
  LocalFeatures features = worker.local->extract(grey);
  dropMasked(image.mask, features);
  return {image.pose, std::move(features), worker.global.extract(withoutMasked(grey, image.mask, worker.masked)),
          previewOf(image.grey)};
}

std::vector<TrainingImage> ExtractionPool::extract(const std::vector<RawImage>& images) {
  std::vector<TrainingImage> extracted(images.size());
  parallelFor(images.size(), workers_.size(),
              [&](std::size_t i, std::size_t worker) { extracted[i] = extract(images[i], workers_[worker]); });
  return extracted;
}

}  // namespace visual_localization

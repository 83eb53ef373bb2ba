#include "map/extraction_pool.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <opencv2/imgcodecs.hpp>

#include "base/numbers.h"
#include "base/parallel.h"
#include "visual_localization/features/front_end.h"

namespace visual_localization {
namespace {

constexpr std::size_t kNeighbours = 2;  ///< Weiss et al., section III

constexpr int kPreviewQuality = 70;

std::vector<std::uint8_t> previewOf(const cv::Mat& grey, int width_px) {
  if (width_px <= 0) return {};
  const int height_px = std::max(1, static_cast<int>(std::lround(1.0 * grey.rows * width_px / grey.cols)));
  cv::Mat small;
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", fitted(grey, {width_px, height_px}, small), jpeg, {cv::IMWRITE_JPEG_QUALITY, kPreviewQuality});
  return jpeg;
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

ExtractionPool::ExtractionPool(const SiftConfig& sift, const std::string& sift_backend, int preview_width_px,
                               std::size_t threads)
    : preview_width_px_(preview_width_px), workers_(std::max<std::size_t>(1, threads)) {
  for (Worker& worker : workers_) worker.sift = makeSiftExtractor(sift, sift_backend);
}

ExtractionPool::~ExtractionPool() = default;

TrainingImage ExtractionPool::extract(const RawImage& image, Worker& worker) const {
  const GreyLevels levels =
      greyLevelsOf(image.grey, image.mask);  // named: GCC 13 and later take the result for a part of it
  const cv::Mat& grey = withUsualContrast(image.grey, levels, worker.spread);
  SiftFeatures features = worker.sift->extract(grey);
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

#include "features/picture_motion.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "base/numbers.h"
#include "base/parallel.h"
#include "base/time.h"
#include "visual_localization/features/feature_matcher.h"
#include "visual_localization/features/sift.h"

namespace visual_localization {
namespace {

constexpr int kWidth_px = 160;            ///< a turn moves the whole picture: small copies show it
constexpr double kShortestStep_s = 0.25;  ///< turns of a robot are slower
constexpr std::size_t kWaitingPerThread = 16;

SiftConfig manyFeatures() {
  SiftConfig config;
  config.contrast_threshold = 0.01;
  config.max_features = 300;
  return config;
}

/// The displacement in pixels that most matches share; nothing when few do.
std::optional<Eigen::Vector2d> sharedDisplacement(const LocalFeatures& from, const LocalFeatures& to) {
  constexpr std::size_t kFewest = 8;
  constexpr double kBox_px = 0.04 * kWidth_px;
  std::vector<Eigen::Vector2d> moves;
  for (const FeatureMatch& match : matchSymmetric(from, to, 1.0)) {
    const Keypoint& a = from.keypoints()[match.a];
    const Keypoint& b = to.keypoints()[match.b];
    moves.emplace_back(b.x_px - a.x_px, b.y_px - a.y_px);
  }
  std::vector<double> right;
  std::vector<double> down;
  std::vector<double> best_right;
  std::vector<double> best_down;
  for (const Eigen::Vector2d& centre : moves) {
    right.clear();
    down.clear();
    for (const Eigen::Vector2d& move : moves) {
      if ((move - centre).lpNorm<Eigen::Infinity>() > kBox_px) continue;
      right.push_back(move.x());
      down.push_back(move.y());
    }
    if (right.size() <= best_right.size()) continue;
    best_right.swap(right);
    best_down.swap(down);
  }
  if (best_right.size() < kFewest) return std::nullopt;
  return Eigen::Vector2d(median(std::move(best_right)), median(std::move(best_down)));
}

}  // namespace

struct PictureMotion::Waiting {
  std::int64_t stamp_ns = 0;
  cv::Mat small;
  LocalFeatures features = {};
};

PictureMotion::PictureMotion(std::size_t threads) : threads_(std::max<std::size_t>(1, threads)) {
  for (std::size_t k = 0; k < threads_; ++k) {
    extractors_.push_back(makeSiftExtractor(manyFeatures()));
  }
}

PictureMotion::~PictureMotion() = default;

bool PictureMotion::wants(std::int64_t stamp_ns) const {
  return !last_ns_ || secondsBetween(*last_ns_, stamp_ns) >= kShortestStep_s;
}

void PictureMotion::add(std::int64_t stamp_ns, const cv::Mat& grey) {
  last_ns_ = stamp_ns;
  if (!isExtractable(grey)) return;
  const int height_px = static_cast<int>(std::lround(static_cast<double>(kWidth_px) * grey.rows / grey.cols));
  Waiting waiting{stamp_ns, {}};
  cv::resize(grey, waiting.small, {kWidth_px, std::clamp(height_px, kSmallestImageSide_px, 4 * kWidth_px)}, 0.0, 0.0,
             cv::INTER_AREA);
  waiting_.push_back(std::move(waiting));
  if (waiting_.size() >= kWaitingPerThread * threads_) extractWaiting();
}

void PictureMotion::extractWaiting() {
  parallelFor(waiting_.size(), threads_, [this](std::size_t i, std::size_t worker) {
    waiting_[i].features = extractors_[worker]->extract(waiting_[i].small);
  });
  for (Waiting& image : waiting_) {
    if (before_) {
      const auto moved_px = sharedDisplacement(*before_, image.features);
      const Eigen::Vector2d moved = moved_px.value_or(Eigen::Vector2d::Zero()) / kWidth_px;
      shifts_.push_back({before_ns_, image.stamp_ns, moved});
    }
    before_ns_ = image.stamp_ns;
    before_ = std::move(image.features);
  }
  waiting_.clear();
}

std::vector<PictureShift> PictureMotion::finish() {
  extractWaiting();
  return std::move(shifts_);
}

}  // namespace visual_localization

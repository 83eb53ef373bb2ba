#include "geometry/self_calibration.h"

#include <algorithm>
#include <cmath>

namespace visual_localization {
namespace {

constexpr double kUsual = 0.8;   ///< focal length as a share of the image's longer side: 64 degrees
constexpr double kBeyond = 1.3;  ///< where the second search begins, as a multiple of where the first one ended
constexpr double kWidest = 0.3;
constexpr double kLongest = 4.0;
constexpr int kMostSteps = 12;
constexpr double kSettled = 0.002;  ///< the last change of a search
constexpr double kSame = 0.01;      ///< difference between the ends of two searches

CameraModel pinhole(const cv::Size& size, double focal_px) {
  return CameraModel(
      {size, focal_px, focal_px, 0.5 * (size.width - 1), 0.5 * (size.height - 1), Distortion::kPlumbBob, {}});
}

/// Adjusts the session with one focal length after the other, each the one that the adjustment before asked for.
class FocalSearch {
 public:
  FocalSearch(UnadjustedSession& session, const cv::Size& size, const GeometryConfig& config, std::size_t threads)
      : session_(session), size_(size), config_(config), threads_(threads) {}

  /// Pixels; nothing when it does not settle.
  std::optional<double> from(double focal_px) const {
    const double longer_px = std::max(size_.width, size_.height);
    for (int step = 0; step < kMostSteps; ++step) {
      const CameraModel camera = pinhole(size_, focal_px);
      session_.camera = &camera;
      const double scale = focalScaleOf(session_, config_, threads_);
      focal_px *= scale;
      if (!(focal_px >= kWidest * longer_px && focal_px <= kLongest * longer_px)) return std::nullopt;
      if (std::abs(scale - 1.0) <= kSettled) return focal_px;
    }
    return std::nullopt;
  }

 private:
  UnadjustedSession& session_;
  const cv::Size& size_;
  const GeometryConfig& config_;
  std::size_t threads_;
};

}  // namespace

std::optional<CameraModel> calibrateByImages(UnadjustedSession session, const cv::Size& size,
                                             const GeometryConfig& config, std::size_t threads) {
  const FocalSearch search(session, size, config, threads);
  const double usual_px = kUsual * std::max(size.width, size.height);
  const std::optional<double> first_px = search.from(usual_px);
  if (!first_px) return std::nullopt;
  const std::optional<double> second_px = search.from(*first_px * (*first_px > usual_px ? kBeyond : 1.0 / kBeyond));
  if (!second_px || std::abs(*first_px / *second_px - 1.0) > kSame) return std::nullopt;
  return pinhole(size, std::sqrt(*first_px * *second_px));
}

}  // namespace visual_localization

#include "node/matches_image.h"

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace visual_localization {
namespace {

constexpr int kSmallestWidth_px = 480;  ///< of one half: lines in smaller ones lie too close together
constexpr int kShiftBits = 4;           ///< OpenCV draws at sixteenths of a pixel

/// Pure colours that stand out on grey, BGR.
const std::array<cv::Scalar, 6> kLineColours{cv::Scalar(60, 220, 255), cv::Scalar(90, 200, 60),
                                             cv::Scalar(255, 170, 60), cv::Scalar(190, 110, 255),
                                             cv::Scalar(60, 140, 255), cv::Scalar(230, 230, 110)};

cv::Mat inColour(const cv::Mat& grey, const cv::Size& size) {
  cv::Mat resized;
  cv::Mat colour;
  cv::resize(grey, resized, size, 0.0, 0.0, cv::INTER_CUBIC);
  cv::cvtColor(resized, colour, cv::COLOR_GRAY2BGR);
  return colour;
}

cv::Mat previewOf(const std::vector<std::uint8_t>& jpeg, const cv::Size& size) {
  cv::Mat preview;
  if (!jpeg.empty()) preview = cv::imdecode(jpeg, cv::IMREAD_GRAYSCALE);
  return preview.empty() ? cv::Mat(size, CV_8UC3, cv::Scalar::all(48)) : inColour(preview, size);
}

/// Centre of pixel (0, 0) of the map's image lies at 0.5 * scale - 0.5 of the enlarged one.
cv::Point shifted(const SiftKeypoint& keypoint, double scale, double offset_x_px) {
  const double x_px = (static_cast<double>(keypoint.x_px) + 0.5) * scale - 0.5 + offset_x_px;
  const double y_px = (static_cast<double>(keypoint.y_px) + 0.5) * scale - 0.5;
  return {cvRound(x_px * (1 << kShiftBits)), cvRound(y_px * (1 << kShiftBits))};
}

}  // namespace

cv::Mat drawMatches(const cv::Mat& grey, const SiftFeatures& sift, const TrainingMap& map, std::size_t training,
                    const MatchConfig& match) {
  const cv::Size map_size = map.header().image_size;
  const double scale =
      map_size.width < kSmallestWidth_px ? static_cast<double>(kSmallestWidth_px) / map_size.width : 1.0;
  const cv::Size half(cvRound(map_size.width * scale), cvRound(map_size.height * scale));
  const std::shared_ptr<const SiftFeatures> training_sift = map.sift(training);

  cv::Mat canvas;
  cv::hconcat(inColour(grey, half), previewOf(map.preview(training), half), canvas);
  std::vector<FeatureMatch> matches;
  matchBy(match, sift, *training_sift, matches);
  std::size_t line = 0;
  for (const FeatureMatch& pair : matches) {
    const cv::Scalar& colour = kLineColours[line++ % kLineColours.size()];
    const cv::Point from = shifted(sift.keypoints()[pair.a], scale, 0.0);
    const cv::Point to = shifted(training_sift->keypoints()[pair.b], scale, half.width);
    cv::line(canvas, from, to, colour, 1, cv::LINE_AA, kShiftBits);
    cv::circle(canvas, from, 4 << kShiftBits, colour, 1, cv::LINE_AA, kShiftBits);
    cv::circle(canvas, to, 4 << kShiftBits, colour, 1, cv::LINE_AA, kShiftBits);
  }
  return canvas;
}

}  // namespace visual_localization

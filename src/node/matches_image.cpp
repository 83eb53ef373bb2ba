#include "node/matches_image.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "features/image_size.h"
#include "ros/compressed_image.h"
#include "visual_localization/ros/image_error.h"

namespace visual_localization {
namespace {

constexpr int kSmallestWidth_px = 480;  ///< of one half: lines in smaller ones lie too close together
constexpr int kShiftBits = 4;           ///< OpenCV draws at sixteenths of a pixel

/// Pure colours that stand out on grey, BGR.
const std::array<cv::Scalar, 6> kLineColours{cv::Scalar(60, 220, 255), cv::Scalar(90, 200, 60),
                                             cv::Scalar(255, 170, 60), cv::Scalar(190, 110, 255),
                                             cv::Scalar(60, 140, 255), cv::Scalar(230, 230, 110)};

const cv::Scalar kInlier(60, 210, 60);
const cv::Scalar kOutlier(50, 50, 235);

cv::Mat inColour(const cv::Mat& grey, const cv::Size& size) {
  cv::Mat resized;
  cv::Mat colour;
  cv::resize(grey, resized, size, 0.0, 0.0, cv::INTER_CUBIC);
  cv::cvtColor(resized, colour, cv::COLOR_GRAY2BGR);
  return colour;
}

/// A uniform grey without a preview, or with one that cannot be decoded: whoever made the map wrote its bytes.
cv::Mat previewOf(const std::vector<std::uint8_t>& jpeg, const cv::Size& size) {
  try {
    if (!jpeg.empty()) return inColour(decodedToGrey(jpeg), size);
  } catch (const ImageError&) {
  }
  return {size, CV_8UC3, cv::Scalar::all(48)};
}

/// To a width that lines need, but no farther than images of a map may go.
double scaleOf(const cv::Size& size) {
  const double largest = std::sqrt(static_cast<double>(kMaxImagePixels) / size.area());
  return std::max(1.0, std::min(static_cast<double>(kSmallestWidth_px) / size.width, largest));
}

/// Two images beside each other, and lines between what both show.
class ImagePair {
 public:
  ImagePair(const cv::Mat& grey, const TrainingMap& map, std::size_t training) {
    const cv::Size size = map.header().image_size;
    scale_ = scaleOf(size);
    half_ = cv::Size(cvRound(size.width * scale_), cvRound(size.height * scale_));
    cv::hconcat(inColour(grey, half_), previewOf(map.preview(training), half_), canvas_);
  }

  /// Pixels of the map's image size.
  void join(const cv::Point2f& left_px, const cv::Point2f& right_px, const cv::Scalar& colour) {
    const cv::Point from = shifted(left_px, 0.0);
    const cv::Point to = shifted(right_px, half_.width);
    cv::line(canvas_, from, to, colour, 1, cv::LINE_AA, kShiftBits);
    cv::circle(canvas_, from, 4 << kShiftBits, colour, 1, cv::LINE_AA, kShiftBits);
    cv::circle(canvas_, to, 4 << kShiftBits, colour, 1, cv::LINE_AA, kShiftBits);
  }

  const cv::Mat& canvas() const { return canvas_; }

 private:
  /// Centre of pixel (0, 0) of the map's image lies at 0.5 * scale - 0.5 of the enlarged one.
  cv::Point shifted(const cv::Point2f& position_px, double offset_x_px) const {
    const double x_px = (static_cast<double>(position_px.x) + 0.5) * scale_ - 0.5 + offset_x_px;
    const double y_px = (static_cast<double>(position_px.y) + 0.5) * scale_ - 0.5;
    return {cvRound(x_px * (1 << kShiftBits)), cvRound(y_px * (1 << kShiftBits))};
  }

  double scale_ = 1.0;
  cv::Size half_;
  cv::Mat canvas_;
};

cv::Point2f positionOf(const SiftKeypoint& keypoint) { return {keypoint.x_px, keypoint.y_px}; }

}  // namespace

cv::Mat drawMatches(const cv::Mat& grey, const SiftFeatures& sift, const TrainingMap& map, std::size_t training,
                    const MatchConfig& match) {
  ImagePair images(grey, map, training);
  const std::shared_ptr<const SiftFeatures> training_sift = map.sift(training);
  std::vector<FeatureMatch> matches;
  matchBy(match, sift, *training_sift, matches);
  std::size_t line = 0;
  for (const FeatureMatch& pair : matches) {
    images.join(positionOf(sift.keypoints()[pair.a]), positionOf(training_sift->keypoints()[pair.b]),
                kLineColours[line++ % kLineColours.size()]);
  }
  return images.canvas();
}

cv::Mat drawLandmarks(const cv::Mat& grey, const MatchedLandmarks& matched, const TrainingMap& map) {
  ImagePair images(grey, map, matched.training_image);
  const std::shared_ptr<const SiftFeatures> training_sift = map.sift(matched.training_image);
  for (const bool inlier : {false, true}) {  // what counts lies on top
    for (const MatchedLandmark& landmark : matched.landmarks) {
      if (landmark.inlier != inlier || landmark.training_feature >= training_sift->size()) continue;
      images.join({landmark.seen_px.x(), landmark.seen_px.y()},
                  positionOf(training_sift->keypoints()[landmark.training_feature]), inlier ? kInlier : kOutlier);
    }
  }
  return images.canvas();
}

}  // namespace visual_localization

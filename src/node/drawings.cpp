#include "node/drawings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "base/numbers.h"
#include "features/image_size.h"
#include "visual_localization/ros/image_conversion.h"

namespace visual_localization {
namespace {

constexpr int kSmallestWidth_px = 480;  ///< of one half: lines in smaller ones lie too close together
constexpr int kShiftBits = 4;           ///< OpenCV draws at sixteenths of a pixel

/// BGR.
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

/// A uniform grey without a preview, or with one that cannot be decoded.
cv::Mat previewOf(const std::vector<std::uint8_t>& jpeg, const cv::Size& size) {
  try {
    if (!jpeg.empty()) return inColour(decodedToGrey(jpeg), size);
  } catch (const ImageError&) {
  }
  return {size, CV_8UC3, cv::Scalar::all(48)};
}

/// No farther than images of a map may go.
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
  /// Pixel (0, 0) of the map's image has its centre at 0.5 * scale - 0.5 of the enlarged one.
  cv::Point shifted(const cv::Point2f& position_px, double offset_x_px) const {
    const double x_px = (static_cast<double>(position_px.x) + 0.5) * scale_ - 0.5 + offset_x_px;
    const double y_px = (static_cast<double>(position_px.y) + 0.5) * scale_ - 0.5;
    return {cvRound(x_px * (1 << kShiftBits)), cvRound(y_px * (1 << kShiftBits))};
  }

  double scale_ = 1.0;
  cv::Size half_;
  cv::Mat canvas_;
};

cv::Point2f positionOf(const Keypoint& keypoint) { return {keypoint.x_px, keypoint.y_px}; }

}  // namespace

cv::Mat drawMatches(const cv::Mat& grey, const LocalFeatures& sift, const TrainingMap& map, std::size_t training,
                    const MatchConfig& match) {
  ImagePair images(grey, map, training);
  const std::shared_ptr<const LocalFeatures> training_sift = map.local(training);
  std::vector<FeatureMatch> matches;
  map.header().kind->match(match, sift, *training_sift, map.header().image_size.width, matches);
  std::size_t line = 0;
  for (const FeatureMatch& pair : matches) {
    images.join(positionOf(sift.keypoints()[pair.a]), positionOf(training_sift->keypoints()[pair.b]),
                kLineColours[line++ % kLineColours.size()]);
  }
  return images.canvas();
}

cv::Mat drawLandmarks(const cv::Mat& grey, const MatchedLandmarks& matched, const TrainingMap& map) {
  ImagePair images(grey, map, matched.training_image);
  const std::shared_ptr<const LocalFeatures> training_sift = map.local(matched.training_image);
  for (const bool inlier : {false, true}) {  // what counts lies on top
    for (const MatchedLandmark& landmark : matched.landmarks) {
      if (landmark.inlier != inlier || landmark.training_feature >= training_sift->size()) continue;
      images.join({landmark.seen_px.x(), landmark.seen_px.y()},
                  positionOf(training_sift->keypoints()[landmark.training_feature]), inlier ? kInlier : kOutlier);
    }
  }
  return images.canvas();
}

namespace {

constexpr int kWidth = 640;
constexpr int kHeader = 96;
constexpr int kRowHeight = 48;
constexpr int kBand = 32;
constexpr int kMargin = 18;
constexpr int kValueRight = 318;  ///< figures end here
constexpr int kCurveLeft = 342;
constexpr int kCurveRight = kWidth - kMargin;

const cv::Scalar kBackground(30, 26, 24);
const cv::Scalar kFaint(120, 112, 108);
const cv::Scalar kLabel(190, 184, 180);
const cv::Scalar kBrightColour(250, 250, 250);
const cv::Scalar kCurve(235, 190, 110);
const cv::Scalar kBad(90, 150, 255);

using Statuses = std::deque<LocalizationStatus>;
using Figure = std::function<double(const LocalizationStatus&)>;

/// One line of the picture.
struct Row {
  std::string label;
  std::string value;
  Figure figure;                    ///< what the curve shows
  bool bad = false;                 ///< the value
  std::optional<double> most = {};  ///< of the scale; nothing: the largest value shown
  std::optional<double> mark = {};  ///< a threshold
};

std::string format(const char* pattern, double number) {
  char text[64];
  std::snprintf(text, sizeof text, pattern, number);
  return text;
}

/// Whether the text begins or ends at `x`.
enum class Align { kLeft, kRight };
void write(cv::Mat& canvas, const std::string& text, int x, int y, double scale, const cv::Scalar& colour,
           Align align = Align::kLeft, int thickness = 1) {
  int baseline = 0;
  const int width = cv::getTextSize(text, cv::FONT_HERSHEY_DUPLEX, scale, thickness, &baseline).width;
  cv::putText(canvas, text, {align == Align::kLeft ? x : x - width, y}, cv::FONT_HERSHEY_DUPLEX, scale, colour,
              thickness, cv::LINE_AA);
}

/// The newest image stands at the right end.
int columnOf(std::size_t i, std::size_t count) {
  const auto age = static_cast<double>(count - 1 - i);
  return cvRound(kCurveRight - age * (kCurveRight - kCurveLeft) / static_cast<double>(Dashboard::kShown - 1));
}

/// The clock of a played bag lags behind the stamps by a few milliseconds; only larger differences show.
std::string latencyText(double latency_ms) {
  constexpr double kSmallLag_ms = 50.0;
  if (latency_ms == -1.0) return "-";  // the image has no stamp
  return format("%.0f ms", latency_ms > -kSmallLag_ms ? std::max(0.0, latency_ms) : latency_ms);
}

std::string inliersText(const LocalizationStatus& status) {
  const bool is_metric = status.source == LocalizationStatus::METRIC;
  return status.source_name + (is_metric ? ", " + std::to_string(status.inliers) : "");
}

std::string sigmaText(const LocalizationStatus& status) {
  return format("%.2f m, ", status.sigma_position) + format("%.1f deg", toDegrees(status.sigma_heading));
}

/// Unknown probabilities have no figure.
std::string shareText(double probability) { return std::isfinite(probability) ? format("%.2f", probability) : "-"; }

std::vector<Row> rowsOf(const LocalizationStatus& now) {
  constexpr double kLargeSigma_m = 5.0;
  constexpr double kLongLatency_ms = 500.0;
  const std::optional<double> threshold =
      std::isfinite(now.min_probability) ? std::optional(now.min_probability) : std::nullopt;
  std::vector<Row> rows{
      {"probability here", shareText(now.probability), [](const auto& s) { return s.probability; },
       now.probability < now.min_probability, 1.0, threshold},
      {"off the map", shareText(now.off_map), [](const auto& s) { return s.off_map; }, now.off_map > 0.5, 1.0},
      {"inliers", inliersText(now), [](const auto& s) { return static_cast<double>(s.inliers); }},
      {"sigma", sigmaText(now), [](const auto& s) { return s.sigma_position; }, now.sigma_position > kLargeSigma_m},
      {"similarity", format("%.2f", now.best_similarity), [](const auto& s) { return s.best_similarity; }},
      {"images compared", std::to_string(now.comparisons),
       [](const auto& s) { return static_cast<double>(s.comparisons); }},
      {"latency", latencyText(now.latency_ms), [](const auto& s) { return std::max(0.0, s.latency_ms); },
       now.latency_ms > kLongLatency_ms},
  };
  const bool answers_an_image = now.best_image >= 0;
  if (!answers_an_image) {
    for (Row& row : rows) row.value = "-";
  }
  return rows;
}

void drawHeader(cv::Mat& canvas, const LocalizationStatus& now) {
  cv::rectangle(canvas, {0, 0, kWidth, kHeader}, colourOfState(now.state), cv::FILLED);
  write(canvas, now.state_name, kMargin, 43, 1.25, kBrightColour, Align::kLeft, 3);
  const std::string lost =
      std::to_string(now.images_dropped) + " dropped, " + std::to_string(now.images_refused) + " refused";
  write(canvas, "image " + std::to_string(now.images_processed), kCurveRight, 27, 0.65, kBrightColour, Align::kRight);
  const bool bad = now.images_dropped + now.images_refused > 0;
  write(canvas, lost, kCurveRight, 50, 0.55, bad ? kBad : kBrightColour, Align::kRight);
  constexpr std::size_t kLine = 76;  // characters that fit
  int y = 71;
  for (const std::string& line : inLines(now.reason.sentence, kLine)) {
    write(canvas, line, kMargin, y, 0.45, kBrightColour);
    y += 18;
  }
}

void drawCurve(cv::Mat& canvas, const Statuses& statuses, const Row& row, int top, int bottom) {
  double largest = row.most.value_or(0.0);
  if (!row.most) {
    for (const auto& status : statuses) {
      const double value = row.figure(status);
      if (std::isfinite(value)) largest = std::max(largest, value);
    }
  }
  cv::line(canvas, {kCurveLeft, bottom}, {kCurveRight, bottom}, kFaint, 2);
  if (!(largest > 0.0)) return;
  write(canvas, format("%.3g", largest), kCurveRight, top + 4, 0.35, kFaint, Align::kRight);
  const auto heightOf = [&](double value) {
    return bottom - cvRound(std::clamp(value / largest, 0.0, 1.0) * (bottom - top));
  };
  if (row.mark) cv::line(canvas, {kCurveLeft, heightOf(*row.mark)}, {kCurveRight, heightOf(*row.mark)}, kFaint, 1);
  std::optional<cv::Point> before;  // no line across what is unknown
  for (std::size_t i = 0; i < statuses.size(); ++i) {
    const double value = row.figure(statuses[i]);
    const cv::Point point(columnOf(i, statuses.size()), std::isfinite(value) ? heightOf(value) : bottom);
    if (before && std::isfinite(value)) cv::line(canvas, *before, point, kCurve, 2, cv::LINE_AA);
    before = std::isfinite(value) ? std::optional(point) : std::nullopt;
  }
  if (before) cv::circle(canvas, *before, 4, kBrightColour, cv::FILLED, cv::LINE_AA);
}

void drawRow(cv::Mat& canvas, const Statuses& statuses, const Row& row, int top) {
  write(canvas, row.label, kMargin, top + 33, 0.65, kLabel);
  write(canvas, row.value, kValueRight, top + 33, 0.8, row.bad ? kBad : kBrightColour, Align::kRight, 2);
  drawCurve(canvas, statuses, row, top + 9, top + kRowHeight - 8);
}

void drawBand(cv::Mat& canvas, const Statuses& statuses, int top) {
  write(canvas, "state, last " + std::to_string(Dashboard::kShown) + " images", kMargin, top + 21, 0.65, kLabel);
  const auto edgeOf = [](std::size_t age) {
    return kCurveRight - cvRound(static_cast<double>(age) * (kCurveRight - kCurveLeft) / Dashboard::kShown);
  };
  for (std::size_t i = 0; i < statuses.size(); ++i) {
    const std::size_t age = statuses.size() - 1 - i;
    const cv::Point top_left(edgeOf(age + 1), top + 6);
    const cv::Point bottom_right(edgeOf(age), top + kBand - 8);
    cv::rectangle(canvas, cv::Rect(top_left, bottom_right), colourOfState(statuses[i].state), cv::FILLED);
  }
}

}  // namespace

std::vector<std::string> inLines(std::string text, std::size_t most) {
  std::vector<std::string> lines;
  while (text.size() > most) {
    const std::size_t space = text.rfind(' ', most);
    const bool found = space != std::string::npos && space > 0;
    lines.push_back(text.substr(0, found ? space : most));
    text.erase(0, found ? space + 1 : most);
  }
  lines.push_back(std::move(text));
  return lines;
}

cv::Scalar colourOfState(std::uint8_t state) {
  switch (state) {
    case LocalizationStatus::TRACKING:
      return {44, 150, 44};
    case LocalizationStatus::UNCERTAIN:
      return {14, 127, 255};
    case LocalizationStatus::RECOVERING:
      return {40, 39, 214};
    case LocalizationStatus::OFF_MAP:
      return {189, 103, 148};
    case LocalizationStatus::INITIALIZING:
      return {127, 127, 127};
    default:
      return {80, 80, 80};
  }
}

cv::Mat greyedOut(const cv::Mat& canvas, const std::string& reason) {
  cv::Mat grey;
  cv::cvtColor(canvas, grey, cv::COLOR_BGR2GRAY);
  cv::cvtColor(grey, grey, cv::COLOR_GRAY2BGR);
  grey *= 0.4;
  write(grey, reason, kMargin, grey.rows / 2, 0.8, kBrightColour, Align::kLeft, 2);
  return grey;
}

void Dashboard::add(const LocalizationStatus& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  statuses_.push_back(status);
  if (statuses_.size() > kShown) statuses_.pop_front();
}

cv::Mat Dashboard::draw() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  constexpr int kRows = 7;
  cv::Mat canvas(kHeader + kRows * kRowHeight + kBand + 10, kWidth, CV_8UC3, kBackground);
  if (statuses_.empty()) return canvas;
  drawHeader(canvas, statuses_.back());
  int top = kHeader + 4;
  for (const Row& row : rowsOf(statuses_.back())) {
    drawRow(canvas, statuses_, row, top);
    top += kRowHeight;
  }
  drawBand(canvas, statuses_, top + 4);
  return canvas;
}

}  // namespace visual_localization

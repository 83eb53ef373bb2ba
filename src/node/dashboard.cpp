#include "node/dashboard.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace visual_localization {
namespace {

// The picture, in pixels: a header, rows of figures, a band of states.
constexpr int kWidth = 640;
constexpr int kHeader = 70;
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

using Statuses = std::deque<LocalizationStatus>;
using Figure = std::function<double(const LocalizationStatus&)>;

/// One line of the picture.
struct Row {
  std::string label;
  std::string value;
  Figure figure;  ///< what the curve shows
};

std::string format(const char* pattern, double number) {
  char text[64];
  std::snprintf(text, sizeof text, pattern, number);
  return text;
}

/// Writes with the baseline at `y`; the text begins at `x`, or ends there.
enum class Align { kLeft, kRight };
void write(cv::Mat& canvas, const std::string& text, int x, int y, double scale, const cv::Scalar& colour,
           Align align = Align::kLeft, int thickness = 1) {
  int baseline = 0;
  const int width = cv::getTextSize(text, cv::FONT_HERSHEY_DUPLEX, scale, thickness, &baseline).width;
  cv::putText(canvas, text, {align == Align::kLeft ? x : x - width, y}, cv::FONT_HERSHEY_DUPLEX, scale, colour,
              thickness, cv::LINE_AA);
}

/// The i-th of the remembered images; the newest stands at the right end.
int columnOf(std::size_t i, std::size_t count) {
  const auto age = static_cast<double>(count - 1 - i);
  return cvRound(kCurveRight - age * (kCurveRight - kCurveLeft) / static_cast<double>(Dashboard::kShown - 1));
}

/// A clock that is played from a bag lags behind the stamps by a few milliseconds, which would only confuse; larger
/// differences of the clocks show.
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
  constexpr double kDegreesPerRadian = 180.0 / M_PI;
  return format("%.2f m, ", status.sigma_position) + format("%.1f deg", status.sigma_heading * kDegreesPerRadian);
}

std::vector<Row> rowsOf(const LocalizationStatus& now) {
  std::vector<Row> rows{
      {"inliers", inliersText(now), [](const auto& s) { return static_cast<double>(s.inliers); }},
      {"sigma", sigmaText(now), [](const auto& s) { return s.sigma_position; }},
      {"similarity", format("%.2f", now.best_similarity), [](const auto& s) { return s.best_similarity; }},
      {"place ratio", format("%.3f", now.place_ratio), [](const auto& s) { return s.place_ratio; }},
      {"images compared", std::to_string(now.comparisons),
       [](const auto& s) { return static_cast<double>(s.comparisons); }},
      {"cloud x, y", format("%.1f, ", now.sigma_x) + format("%.1f m", now.sigma_y),
       [](const auto& s) { return std::hypot(s.sigma_x, s.sigma_y); }},
      {"latency", latencyText(now.latency_ms), [](const auto& s) { return std::max(0.0, s.latency_ms); }},
  };
  const bool answers_an_image = now.best_image >= 0;
  if (!answers_an_image) {
    for (Row& row : rows) row.value = "-";
  }
  return rows;
}

void drawHeader(cv::Mat& canvas, const LocalizationStatus& now) {
  cv::rectangle(canvas, {0, 0, kWidth, kHeader}, colourOfState(now.state), cv::FILLED);
  write(canvas, now.state_name, kMargin, 48, 1.25, kBrightColour, Align::kLeft, 3);
  const std::string lost =
      std::to_string(now.images_dropped) + " dropped, " + std::to_string(now.images_refused) + " refused";
  write(canvas, "image " + std::to_string(now.images_processed), kCurveRight, 31, 0.65, kBrightColour, Align::kRight);
  write(canvas, lost, kCurveRight, 56, 0.55, kBrightColour, Align::kRight);
}

/// From zero to the largest of the shown figures.
void drawCurve(cv::Mat& canvas, const Statuses& statuses, const Figure& figure, int top, int bottom) {
  double largest = 0.0;
  for (const auto& status : statuses) largest = std::max(largest, figure(status));
  cv::line(canvas, {kCurveLeft, bottom}, {kCurveRight, bottom}, kFaint, 2);
  if (!(largest > 0.0) || !std::isfinite(largest)) return;
  std::vector<cv::Point> points;
  for (std::size_t i = 0; i < statuses.size(); ++i) {
    const double share = std::clamp(figure(statuses[i]) / largest, 0.0, 1.0);
    const double height = std::isfinite(share) ? share * (bottom - top) : 0.0;
    points.emplace_back(columnOf(i, statuses.size()), bottom - cvRound(height));
  }
  cv::polylines(canvas, points, false, kCurve, 2, cv::LINE_AA);
  cv::circle(canvas, points.back(), 4, kBrightColour, cv::FILLED, cv::LINE_AA);
}

void drawRow(cv::Mat& canvas, const Statuses& statuses, const Row& row, int top) {
  write(canvas, row.label, kMargin, top + 33, 0.65, kLabel);
  write(canvas, row.value, kValueRight, top + 33, 0.8, kBrightColour, Align::kRight, 2);
  drawCurve(canvas, statuses, row.figure, top + 9, top + kRowHeight - 8);
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

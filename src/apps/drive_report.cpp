#include "apps/drive_report.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace visual_localization::apps {
namespace {

using nlohmann::json;

// With the rest of a page of 20000 images below 30 MB.
constexpr std::size_t kImages_bytes = 8'000'000;
constexpr std::size_t kPreviews_bytes = 4'000'000;

std::vector<std::uint8_t> thumbnail(const cv::Mat& grey) {
  constexpr int kWidth_px = 160;
  constexpr int kQuality = 60;
  const double scale = std::min(1.0, static_cast<double>(kWidth_px) / grey.cols);
  cv::Mat small;
  cv::resize(grey, small, {}, scale, scale, cv::INTER_AREA);
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", small, jpeg, {cv::IMWRITE_JPEG_QUALITY, kQuality});
  return jpeg;
}

}  // namespace

DriveReport::DriveReport(const std::string& bag, const std::string& image_topic)
    : drive_{{"bag", bag}, {"image_topic", image_topic}, {"landmarks", json::object()}},
      images_(kImages_bytes),
      previews_(kPreviews_bytes) {}

void DriveReport::add(const Estimate& estimate, const Localizer& localizer, const cv::Mat& grey,
                      const std::optional<Eigen::Vector2d>& truth_m) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  if (count_ == 0) first_ns_ = estimate.stamp_ns;
  const PoseEstimate& pose = estimate.pose;
  put("t", pageNumber(1e-9 * static_cast<double>(estimate.stamp_ns - first_ns_), 3));
  put("east", pageNumber(pose.position_m.x(), 3));
  put("north", pageNumber(pose.position_m.y(), 3));
  put("yaw", pageNumber(pose.yaw_rad, 3));
  put("true_east", pageNumber(truth_m ? truth_m->x() : kUnknown, 3));
  put("true_north", pageNumber(truth_m ? truth_m->y() : kUnknown, 3));
  put("state", toString(estimate.state));
  put("source", toString(estimate.source));
  put("sigma", pageNumber(largerSigma(pose.covariance_m2), 3));  // the map's own included, as in a track
  put("probability", pageNumber(estimate.evidence.probability.value_or(kUnknown), 4));
  put("off_map", pageNumber(estimate.belief.off_map, 4));
  put("unconfirmed", estimate.unconfirmed);
  put("reason", textOf(estimate.why.reason).name);
  put("sentence", describe(estimate.why));
  const std::optional<PlaceBelief::Place>& rival = estimate.belief.rival;
  put("rival", pageNumber(rival ? rival->probability : kUnknown, 4));
  put("rival_east", pageNumber(rival ? rival->position_m.x() : kUnknown, 1));
  put("rival_north", pageNumber(rival ? rival->position_m.y() : kUnknown, 1));
  put("similarity", pageNumber(estimate.tracked.best.similarity, 4));
  put("matches", estimate.tracked.best.matches);
  put("inliers", estimate.metric ? estimate.metric->inliers : 0);
  put("best", estimate.tracked.best_image);
  put("comparisons", estimate.comparisons);
  put("features", estimate.image.features_kept);
  put("latency", pageNumber(estimate.image.extract_ms + estimate.image.match_ms + estimate.update_ms, 1));
  put("grey", pageNumber(estimate.image.statistics.mean_grey, 1));
  put("contrast", pageNumber(estimate.image.statistics.contrast, 1));
  if (images_.wants(count_)) {
    images_.add(count_, thumbnail(grey));
    const std::size_t best = estimate.tracked.best_image;
    if (previews_.wants(best)) previews_.add(best, localizer.map().preview(best));
    addLandmarks(localizer);
  }
  ++count_;
}

/// [x, y, agrees] each, pixels of the map's size; a part of many.
void DriveReport::addLandmarks(const Localizer& localizer) {
  constexpr std::size_t kMost = 80;
  const std::vector<MatchedLandmark> landmarks = localizer.lastLandmarks().landmarks;
  if (landmarks.empty()) return;
  json shown = json::array();
  for (std::size_t i = 0; i < landmarks.size(); i += (landmarks.size() + kMost - 1) / kMost) {
    const MatchedLandmark& landmark = landmarks[i];
    shown.push_back(
        {pageNumber(landmark.seen_px.x(), 0), pageNumber(landmark.seen_px.y(), 0), landmark.inlier ? 1 : 0});
  }
  drive_["landmarks"][std::to_string(count_)] = std::move(shown);
}

std::string DriveReport::page(const std::string& map_path, const TrainingMap& map) const {
  json drive = drive_;
  drive["start_s"] = pageNumber(1e-9 * static_cast<double>(first_ns_), 3);
  for (std::size_t i = 0; i < kReasons; ++i) {
    const ReasonText& text = textOf(static_cast<StateReason>(i));
    drive["reason_words"][text.name] = text.sentence;
    if (text.advice != std::string("-")) drive["advice"][text.name] = text.advice;
  }
  drive["images"] = images_.toJson();
  drive["image_size"] = {map.header().image_size.width, map.header().image_size.height};
  json shown_map = pageMap(map_path, map);
  shown_map["previews"] = previews_.toJson();
  return reportPage({{"map", std::move(shown_map)}, {"drive", std::move(drive)}});
}

}  // namespace visual_localization::apps

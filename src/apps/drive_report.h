#pragma once

#include <optional>
#include <string>

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "apps/report_page.h"
#include "visual_localization/localization/localizer.h"

namespace visual_localization::apps {

/// Gathers a drive image by image for its page.
class DriveReport {
 public:
  /// `bag` and `image_topic`: where the drive was read, for the commands that the page names.
  DriveReport(const std::string& bag, const std::string& image_topic);

  /// `grey`: the image that `localizer` saw last; `truth_m`: where it was taken, if known.
  void add(const Estimate& estimate, const Localizer& localizer, const cv::Mat& grey,
           const std::optional<Eigen::Vector2d>& truth_m);

  /// The HTML page. `map_path` is the map's file. There must have been an image.
  std::string page(const std::string& map_path, const TrainingMap& map) const;

 private:
  void put(const char* column, nlohmann::json value) { drive_[column].push_back(std::move(value)); }
  void addLandmarks(const Localizer& localizer);

  nlohmann::json drive_;
  std::int64_t first_ns_ = 0;
  std::size_t count_ = 0;
  PagePictures images_;
  PagePictures previews_;
};

}  // namespace visual_localization::apps

#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "test/support/synthetic.h"
#include "visual_localization/features/feature_matcher.h"
#include "visual_localization/features/global_features.h"
#include "visual_localization/features/sift.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization::test {

constexpr std::int64_t kSecond = 1000000000;

/// A street of 60 training images along a wall, and a camera that drives along it.
class WallStreet : public ::testing::Test {
 protected:
  static constexpr int kImages = 60;
  static constexpr int kPixelsPerImage = 20;
  static constexpr double kMetresPerImage = 0.6;

  /// What the camera sees at `metres` along the street.
  static cv::Mat viewAt(double metres) {
    static const cv::Mat all = wall(kImages * kPixelsPerImage + 320, 240, 21);
    return viewOf(all, static_cast<int>(metres / kMetresPerImage * kPixelsPerImage));
  }

  /// As a camera shows it that has noise: no two images are the same, even if it stands still.
  static cv::Mat noisy(const cv::Mat& view, int number, double sigma = 1.0) {
    cv::Mat noise(view.size(), CV_16SC1);
    cv::RNG random(static_cast<std::uint64_t>(number) + 1);
    random.fill(noise, cv::RNG::NORMAL, 0.0, sigma);
    cv::Mat image;
    cv::add(view, noise, image, cv::noArray(), CV_8U);
    return image;
  }

  /// Made when first asked for, since not every test needs it.
  static const std::shared_ptr<const TrainingMap>& map() {
    static const std::shared_ptr<const TrainingMap> made = makeMap();
    return made;
  }

 private:
  static std::shared_ptr<const TrainingMap> makeMap() {
    const auto sift_extractor = makeSiftExtractor(SiftConfig());
    GlobalExtractor global_extractor;
    std::vector<TrainingImage> images(kImages);
    std::vector<LocalFeatures> unpruned;
    for (std::size_t i = 0; i < images.size(); ++i) {
      images[i].stamp_ns = static_cast<std::int64_t>(i) * kSecond;
      images[i].position_m = {kMetresPerImage * static_cast<double>(i), 0.0};
      const cv::Mat view = viewAt(images[i].position_m.x() + 1e-9);
      images[i].global = global_extractor.extract(view);
      unpruned.push_back(sift_extractor->extract(view));
    }
    for (std::size_t i = 0; i < images.size(); ++i) {
      images[i].local = keepSeenIn(unpruned[i], {&unpruned[i == 0 ? 1 : i - 1]}, 0.6);
    }
    MapHeader header;
    header.datum = {48.5, 9.0, 400.0};
    header.image_size = {320, 240};
    header.sessions = {{"wall"}};
    return std::make_shared<TrainingMap>(header, std::move(images));
  }
};

}  // namespace visual_localization::test

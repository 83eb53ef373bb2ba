#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "visual_localization/map/training_map.h"

namespace visual_localization::test {

inline SiftFeatures randomFeatures(std::size_t count, std::mt19937& random) {
  std::uniform_int_distribution<int> byte(0, 255);
  std::uniform_real_distribution<float> pixel(0.0F, 320.0F);
  std::vector<SiftKeypoint> keypoints(count);
  std::vector<std::uint8_t> descriptors(count * SiftFeatures::kDescriptorSize);
  for (auto& keypoint : keypoints) keypoint = {pixel(random), pixel(random), 4.0F, pixel(random)};
  for (auto& value : descriptors) value = static_cast<std::uint8_t>(byte(random));
  return SiftFeatures(keypoints, descriptors);
}

inline GlobalFeatures::Histogram randomHistogram(std::mt19937& random) {
  std::uniform_real_distribution<float> share(0.0F, 0.01F);
  GlobalFeatures::Histogram histogram{};
  for (float& value : histogram) value = share(random);
  return histogram;
}

/// A calibrated camera of 320 x 240 pixels.
inline CameraModel exampleCamera() {
  return CameraModel({{320, 240}, 266.25, 266.5, 159.5, 119.5, Distortion::kPlumbBob, {-0.1, 0.01, 1e-4, -1e-4, 0.0}});
}

/// Of 320 x 240 pixels; the robot is seen in the lowest rows.
inline Mask exampleMask() {
  cv::Mat grey(240, 320, CV_8U, cv::Scalar(255));
  grey.rowRange(200, 240).setTo(0);
  grey.at<std::uint8_t>(200, 0) = 255;
  return Mask(grey);
}

/// The first session has a camera and a mask.
inline MapHeader exampleHeader() {
  MapHeader header;
  header.datum = {48.5, 9.05, 430.25};
  header.image_size = {320, 240};
  header.sift.contrast_threshold = 0.03;
  header.sessions = {{"monday", exampleCamera(), exampleMask()}, {"tuesday \"quoted\" \xC3\xA4"}};
  return header;
}

/// `count` images on a curve, half of them in each session; the first has no features of any kind and no preview.
inline std::vector<TrainingImage> exampleImages(std::size_t count, std::size_t features = 20, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::vector<TrainingImage> images(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double turn = 0.1 * static_cast<double>(i);
    images[i].stamp_ns = 1'221'210'001'000'000'000 + static_cast<std::int64_t>(i) * 1'000'000'007;
    images[i].session = i < count / 2 ? 0 : 1;
    images[i].position_m = {50.0 * std::cos(turn), i == 0 ? -0.0 : 30.0 * std::sin(turn)};
    images[i].yaw_rad = turn - 1.0 / 3.0;
    if (i == 0) continue;
    images[i].sift = randomFeatures(features, random);
    images[i].global.wgoh = randomHistogram(random);
    images[i].global.wgii = randomHistogram(random);
    images[i].preview_jpeg = {0xFF, 0xD8, static_cast<std::uint8_t>(i)};
  }
  return images;
}

}  // namespace visual_localization::test

#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "map/map_schema.h"
#include "visual_localization/features/sift.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization::test {

inline LocalFeatures randomFeatures(std::size_t count, std::mt19937& random) {
  std::uniform_int_distribution<int> byte(0, 255);
  std::uniform_real_distribution<float> pixel(0.0F, 320.0F);
  std::vector<Keypoint> keypoints(count);
  std::vector<std::uint8_t> descriptors(count * kSiftDimension);
  for (auto& keypoint : keypoints) keypoint = {pixel(random), pixel(random), 4.0F, pixel(random)};
  for (auto& value : descriptors) value = static_cast<std::uint8_t>(byte(random));
  return LocalFeatures(keypoints, descriptors);
}

inline GlobalFeatures::Histogram randomHistogram(std::mt19937& random) {
  std::uniform_real_distribution<float> share(0.0F, 0.01F);
  GlobalFeatures::Histogram histogram{};
  for (float& value : histogram) value = share(random);
  return histogram;
}

/// 320 x 240 pixels.
inline CameraModel exampleCamera() {
  return CameraModel({{320, 240}, 266.25, 266.5, 159.5, 119.5, Distortion::kPlumbBob, {-0.1, 0.01, 1e-4, -1e-4, 0.0}});
}

/// 320 x 240 pixels; the robot is seen in the lowest rows.
inline Mask exampleMask() {
  cv::Mat grey(240, 320, CV_8U, cv::Scalar(255));
  grey.rowRange(200, 240).setTo(0);
  grey.at<std::uint8_t>(200, 0) = 255;
  return Mask(grey);
}

/// A camera ahead that looks a little to the left, an antenna behind.
inline SensorMount exampleMount() {
  SensorMount mount;
  mount.camera = parseCameraMount("0.25 0.125 1.0 0.25 0 0");
  mount.antenna_m = {-0.5, 0.25, 0.75};
  return mount;
}

/// The first session has a camera, a mask and a mount.
inline MapHeader exampleHeader() {
  MapHeader header;
  header.datum = {48.5, 9.05, 430.25};
  header.image_size = {320, 240};
  SiftConfig sift;
  sift.contrast_threshold = 0.03;
  header.kind = std::make_shared<Sift>(sift);
  header.sessions = {{"monday", exampleCamera(), exampleMask(), exampleMount()}, {"tuesday \"quoted\" \xC3\xA4"}};
  return header;
}

/// A covariance that floats hold exactly; position and rotation depend on each other.
inline Eigen::Matrix<double, 6, 6> exampleCovariance() {
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  covariance.diagonal() << 0.25, 0.25, 1.0, 0.0625, 0.0625, 0.03125;
  covariance(0, 5) = covariance(5, 0) = 0.03125;
  return covariance;
}

/// As a map file keeps it: every second feature shows a landmark.
inline ImageGeometry exampleGeometry(std::size_t features, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> metres(-100.0F, 100.0F);
  std::uniform_int_distribution<int> sigma(0, 255);
  ImageGeometry geometry;
  geometry.camera = {levelCamera(0.1 * seed), {50.0 + seed, -1.0 / 3.0, 1.5}};
  geometry.covariance = exampleCovariance();
  for (std::size_t i = 1; i < features; i += 2) {
    const auto sigmaOfAnyClass = [&] { return map_schema::sigmaOf(static_cast<std::uint8_t>(sigma(random))); };
    geometry.landmarks.push_back({static_cast<std::uint32_t>(i),
                                  static_cast<std::uint32_t>(random()),
                                  {metres(random), metres(random), metres(random)},
                                  sigmaOfAnyClass(),
                                  sigmaOfAnyClass()});
  }
  return geometry;
}

/// To the last bit.
inline bool same(const SeenLandmark& a, const SeenLandmark& b) {
  return a.feature == b.feature && a.id == b.id && a.offset_m == b.offset_m && a.sigma_along_m == b.sigma_along_m &&
         a.sigma_across_m == b.sigma_across_m;
}

/// To the last bit; none is the same as none.
inline bool same(const std::optional<ImageGeometry>& a, const std::optional<ImageGeometry>& b) {
  if (!a || !b) return !a && !b;
  return a->camera.position_m == b->camera.position_m && a->camera.rotation.coeffs() == b->camera.rotation.coeffs() &&
         a->covariance == b->covariance &&
         std::equal(a->landmarks.begin(), a->landmarks.end(), b->landmarks.begin(), b->landmarks.end(),
                    [](const SeenLandmark& one, const SeenLandmark& other) { return same(one, other); });
}

/// `count` images on a curve, half of them in each session; the first has no features of any kind and no preview. Of
/// three images the first has no geometry.
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
    images[i].local = randomFeatures(features, random);
    images[i].global.wgoh = randomHistogram(random);
    images[i].global.wgii = randomHistogram(random);
    images[i].preview_jpeg = {0xFF, 0xD8, static_cast<std::uint8_t>(i)};
    if (i % 3 != 0) images[i].geometry = exampleGeometry(features, seed + static_cast<unsigned>(i));
  }
  return images;
}

/// Its images are random, and each is described by words of all.
inline TrainingMap describedMap(std::size_t count = 24) {
  MapHeader header = exampleHeader();
  std::vector<TrainingImage> images = exampleImages(count, 30);
  const auto features = [&](std::size_t i) { return std::make_shared<LocalFeatures>(images[i].local); };
  header.vocabulary = VladVocabulary::learn(images.size(), features, header.image_size);
  for (TrainingImage& image : images) image.vlad = header.vocabulary->describe(image.local);
  return {std::move(header), std::move(images)};
}

}  // namespace visual_localization::test

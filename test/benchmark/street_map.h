#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "base/numbers.h"
#include "features/global_histograms.h"
#include "visual_localization/features/sift.h"
#include "visual_localization/map/training_map.h"

namespace visual_localization::benchmark {

/// A grid of streets 100 m apart with an image every metre. Each image shows the landmarks around it, an eighth of them
/// new, so that images eight metres apart share none. All depends on number, visit and seed alone.
class StreetMap {
 public:
  /// `images`, `features` (of an image): at least 1. `located`: landmarks have positions, and features are where they
  /// project to.
  StreetMap(std::size_t images, std::size_t features, std::uint64_t seed, bool located = false)
      : features_(features), new_features_(features / 8 + 1), seed_(seed), located_(located) {
    while (2 * streets_ * (streets_ - 1) * kBlock_m < images) ++streets_;
    // Bytes as they are in descriptors: many small ones, a norm of some 512.
    for (std::size_t i = 0; i < bytes_.size(); ++i) {
      const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(bytes_.size());
      bytes_[i] = static_cast<std::uint8_t>(std::min(255.0, -32.0 * std::log(1.0 - share)));
    }
  }

  static MapHeader header() {
    MapHeader header;
    header.datum = {48.5, 9.05, 400.0};
    header.image_size = {320, 240};
    header.sessions = {{"streets"}};
    return header;
  }

  /// One session, a camera of 62 degrees.
  static MapHeader locatedHeader(const std::string& session) {
    MapHeader located = header();
    located.sessions = {{session, camera()}};
    return located;
  }

  TrainingImage image(std::size_t i) const {
    TrainingImage image;
    static_cast<TrainingPose&>(image) = place(i);
    image.local = view(i, 0);
    image.global = global(i);
    return image;
  }

  /// In a recording of its own: at another time, with a receiver that is off by up to 0.3 m along each axis. `visit`:
  /// from 1.
  TrainingImage locatedImage(std::size_t i, std::uint64_t visit) const {
    constexpr std::int64_t kVisit_ns = 1'000'000'000'000'000;
    TrainingImage image;
    static_cast<TrainingPose&>(image) = place(i);
    image.stamp_ns += static_cast<std::int64_t>(visit) * kVisit_ns;
    image.local = view(i, visit);
    image.global = global(i);
    ImageGeometry geometry;
    geometry.camera = cameraAt(i);
    for (std::size_t f = 0; f < features_; ++f) {
      const std::uint64_t landmark = i * new_features_ + f;
      if (!pixelOf(landmark, i)) continue;
      const Eigen::Vector3d offset_m = position_m(landmark) - geometry.camera.position_m;
      geometry.landmarks.push_back(
          {static_cast<std::uint32_t>(f), static_cast<std::uint32_t>(landmark), offset_m.cast<float>(), 0.1F, 0.03F});
    }
    const std::uint64_t off = mix(visit ^ seed_);
    const Eigen::Vector2d bias_m(0.6 * share(off) - 0.3, 0.6 * share(off >> 16U) - 0.3);
    geometry.camera.position_m.head<2>() += bias_m;
    image.position_m += bias_m;
    Eigen::Matrix<double, 6, 1> sigmas;
    sigmas << 0.15, 0.15, 0.15, 0.004, 0.004, 0.004;
    geometry.covariance = sigmas.cwiseAbs2().asDiagonal();
    image.geometry = std::move(geometry);
    return image;
  }

  /// East-west streets first, up and down like a plough, then those from south to north.
  TrainingPose place(std::size_t i) const {
    const std::size_t length_m = (streets_ - 1) * kBlock_m;
    const std::size_t street = i / length_m;
    const bool back = street % 2 == 1;
    const auto along_m = static_cast<double>(back ? length_m - i % length_m : i % length_m);
    const auto across_m = static_cast<double>(street % streets_ * kBlock_m);
    const bool northwards = street >= streets_;
    TrainingPose place;
    place.stamp_ns = static_cast<std::int64_t>(i) * 1'000'000'000;
    place.position_m = northwards ? Eigen::Vector2d(across_m, along_m) : Eigen::Vector2d(along_m, across_m);
    place.yaw_rad = (northwards ? 0.5 * kPi : 0.0) + (back ? kPi : 0.0);
    return place;
  }

  /// What a camera sees at the place of image `i`: the noise differs from visit to visit.
  LocalFeatures view(std::size_t i, std::uint64_t visit) const {
    std::vector<Keypoint> keypoints(features_);
    std::vector<std::uint8_t> descriptors(features_ * kSiftDimension);
    for (std::size_t f = 0; f < features_; ++f) {
      const std::uint64_t landmark = i * new_features_ + f;
      const std::uint64_t place = mix(landmark ^ seed_);
      keypoints[f] = {static_cast<float>(place % 320), static_cast<float>(place / 320 % 240), 4.0F,
                      static_cast<float>(place >> 32U) * (360.0F / 4294967296.0F)};
      const auto pixel = located_ ? pixelOf(landmark, i) : std::nullopt;
      if (pixel) {
        const std::uint64_t noise = mix(place ^ visit ^ (i << 32U));
        keypoints[f].x_px = static_cast<float>(pixel->x() + share(noise) - 0.5);
        keypoints[f].y_px = static_cast<float>(pixel->y() + share(noise >> 16U) - 0.5);
      }
      describe(landmark, mix(i + (visit << 40U)), &descriptors[f * kSiftDimension]);
    }
    return LocalFeatures(std::move(keypoints), std::move(descriptors));
  }

  /// Changes slowly along a street.
  GlobalFeatures global(std::size_t i) const {
    GlobalFeatures global;
    const auto share = static_cast<float>(i % 8) / 8.0F;
    for (std::size_t b = 0; b < GlobalFeatures::kSize; ++b) {
      global.wgoh[b] = (1.0F - share) * bin(i / 8, b) + share * bin(i / 8 + 1, b);
      global.wgii[b] = (1.0F - share) * bin(i / 8, b + 1000) + share * bin(i / 8 + 1, b + 1000);
    }
    normalise(global.wgoh);
    normalise(global.wgii);
    return global;
  }

 private:
  static constexpr std::size_t kBlock_m = 100;

  static CameraModel camera() {
    return CameraModel({{320, 240}, 266.3, 266.3, 159.5, 119.5, Distortion::kPlumbBob, {}});
  }
  /// From 0 to 1, by the lowest 16 bits.
  static double share(std::uint64_t bits) { return static_cast<double>(bits & 0xFFFFU) / 65535.0; }

  CameraPose cameraAt(std::size_t i) const {
    const TrainingPose at = place(i);
    return {levelCamera(at.yaw_rad), {at.position_m.x(), at.position_m.y(), 0.0}};
  }

  /// Beside the street, ahead of the last image that shows the landmark.
  Eigen::Vector3d position_m(std::uint64_t landmark) const {
    const CameraPose last = cameraAt(landmark / new_features_);
    const std::uint64_t bits = mix(landmark + 0x51ED270B7A1C4F35U + seed_);
    const double ahead_m = 8.0 + 12.0 * share(bits);
    const double beside_m = ahead_m * (0.15 + 0.35 * share(bits >> 16U)) * ((bits >> 48U) % 2 == 0 ? 1.0 : -1.0);
    const double up_m = ahead_m * (0.4 * share(bits >> 32U) - 0.1);
    return last.position_m + last.rotation * Eigen::Vector3d(beside_m, -up_m, ahead_m);
  }

  /// Nothing where the street has turned since.
  std::optional<Eigen::Vector2d> pixelOf(std::uint64_t landmark, std::size_t i) const {
    static const CameraModel lens = camera();
    const Eigen::Vector3d point = cameraAt(i).toCamera(position_m(landmark));
    if (point.z() < 1.0) return std::nullopt;
    const Eigen::Vector2d pixel = lens.project(point);
    const bool inside = pixel.x() > 1.0 && pixel.x() < 318.0 && pixel.y() > 1.0 && pixel.y() < 238.0;
    return inside ? std::optional(pixel) : std::nullopt;
  }

  /// Steele, Lea and Flood, Fast splittable pseudorandom number generators (2014).
  static std::uint64_t mix(std::uint64_t z) {
    z += 0x9E3779B97F4A7C15U;
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBU;
    return z ^ (z >> 31U);
  }

  void describe(std::uint64_t landmark, std::uint64_t visit, std::uint8_t* descriptor) const {
    std::uint64_t bits = 0;
    std::uint64_t noise = 0;
    for (std::size_t b = 0; b < kSiftDimension; ++b) {
      if (b % 8 == 0) {
        bits = mix(16 * landmark + b / 8 + seed_);
        noise = mix(bits ^ visit);
      }
      const int value = bytes_[bits & 255U] + static_cast<int>(noise & 15U);
      descriptor[b] = static_cast<std::uint8_t>(std::min(value, 255));
      bits >>= 8U;
      noise >>= 8U;
    }
  }

  float bin(std::size_t knot, std::size_t b) const { return bytes_[mix(knot * 4096 + b + seed_) & 255U]; }

  std::size_t features_;
  std::size_t new_features_;  ///< of an image against the one before
  std::uint64_t seed_;
  bool located_;
  std::size_t streets_ = 2;  ///< in each direction
  std::array<std::uint8_t, 256> bytes_{};
};

}  // namespace visual_localization::benchmark

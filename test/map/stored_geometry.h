#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "map/map_schema.h"
#include "test/support/example_map.h"

namespace visual_localization::test {

constexpr std::size_t kFeatures = 20;  ///< of an image whose geometry is stored
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

inline sqlite::Bytes bytesOf(const std::vector<std::uint8_t>& bytes) { return {bytes.data(), bytes.size()}; }

/// A change of the example that makes it unusable, and what is said about that.
struct Unusable {
  std::function<void(ImageGeometry&)> change;
  std::string reason;
};

inline std::vector<Unusable> unusable() {
  const std::string covariance = "covariance of the camera's pose";
  return {{[](ImageGeometry& g) { g.camera.position_m.z() = kNan; }, "camera's position"},
          {[](ImageGeometry& g) { g.camera.position_m.x() = HUGE_VAL; }, "camera's position"},
          {[](ImageGeometry& g) { g.camera.position_m.y() = -1.0001e6; }, "camera's position"},
          {[](ImageGeometry& g) { g.camera.rotation.w() = kNan; }, "camera's rotation"},
          {[](ImageGeometry& g) { g.camera.rotation.coeffs() *= 1.001; }, "camera's rotation"},
          {[](ImageGeometry& g) { g.camera.rotation.coeffs().setZero(); }, "camera's rotation"},
          {[](ImageGeometry& g) { g.covariance(2, 2) = kNan; }, covariance},
          {[](ImageGeometry& g) { g.covariance(1, 4) = g.covariance(4, 1) = HUGE_VAL; }, covariance},
          {[](ImageGeometry& g) { g.covariance(3, 3) = -0.01; }, covariance},
          {[](ImageGeometry& g) { g.covariance(1, 4) = g.covariance(4, 1) = 0.5; }, covariance},
          {[](ImageGeometry& g) { g.covariance(0, 0) = 0.0; }, covariance},
          // Each pair is possible, the three together are not.
          {[](ImageGeometry& g) {
             g.covariance.setIdentity();
             g.covariance(0, 1) = g.covariance(1, 0) = 0.9;
             g.covariance(0, 2) = g.covariance(2, 0) = 0.9;
             g.covariance(1, 2) = g.covariance(2, 1) = -0.9;
           },
           covariance},
          {[](ImageGeometry& g) { g.landmarks[4].feature = kFeatures; }, "feature 20 of 20"},
          {[](ImageGeometry& g) { g.landmarks[4].feature = 65535; }, "feature 65535 of 20"},
          {[](ImageGeometry& g) { g.landmarks[4].feature = g.landmarks[3].feature; }, "not in order"},
          {[](ImageGeometry& g) { std::swap(g.landmarks[4], g.landmarks[3]); }, "not in order"},
          {[](ImageGeometry& g) { g.landmarks[4].offset_m.y() = kNan; }, "landmark's offset"},
          {[](ImageGeometry& g) { g.landmarks[4].offset_m.z() = -HUGE_VALF; }, "landmark's offset"},
          {[](ImageGeometry& g) {
             g.landmarks[4].offset_m = {8e4F, 8e4F, 0.0F};
           },
           "landmark's offset"},
          {[](ImageGeometry& g) { g.landmarks[4].offset_m.x() = 3e38F; }, "landmark's offset"}};
}

/// Without asking whether that can be; kFeatures features.
inline map_schema::PackedGeometry packedAsIs(const ImageGeometry& geometry) {
  map_schema::PackedGeometry packed{std::vector<std::uint8_t>(140),
                                    std::vector<std::uint8_t>(20 * geometry.landmarks.size())};
  const CameraPose& camera = geometry.camera;
  for (Eigen::Index i = 0; i < 3; ++i) map_schema::putReal<double>(camera.position_m[i], &packed.pose[8 * i]);
  const double rotation[] = {camera.rotation.w(), camera.rotation.x(), camera.rotation.y(), camera.rotation.z()};
  for (std::size_t i = 0; i < 4; ++i) map_schema::putReal<double>(rotation[i], &packed.pose[24 + 8 * i]);
  std::uint8_t* to = &packed.pose[56];
  for (Eigen::Index row = 0; row < 6; ++row) {
    for (Eigen::Index column = row; column < 6; ++column, to += 4) {
      map_schema::putReal<float>(static_cast<float>(geometry.covariance(row, column)), to);
    }
  }
  to = packed.points.data();
  for (const SeenLandmark& landmark : geometry.landmarks) {
    map_schema::putLittleEndian(static_cast<std::uint16_t>(landmark.feature), to);
    map_schema::putLittleEndian(landmark.id, to + 2);
    for (Eigen::Index i = 0; i < 3; ++i) map_schema::putReal<float>(landmark.offset_m[i], to + 6 + 4 * i);
    to[18] = map_schema::sigmaClass(landmark.sigma_along_m);
    to[19] = map_schema::sigmaClass(landmark.sigma_across_m);
    to += 20;
  }
  return packed;
}

}  // namespace visual_localization::test

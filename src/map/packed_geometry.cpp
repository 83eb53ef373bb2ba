#include "map/packed_geometry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "map/map_geometry.h"

namespace visual_localization::map_schema {
namespace {

/// What a table says is the same on the way there and back, to the last bit.
const std::array<float, 256>& sigmas() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> values{};
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = static_cast<float>(1e-3 * std::pow(1.05, static_cast<double>(i)));
    }
    return values;
  }();
  return table;
}

/// Calls `use` with each number of the upper triangle, row by row.
template <class Matrix, class Use>
void forUpperTriangle(Matrix& matrix, Use use) {
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    for (Eigen::Index column = row; column < matrix.cols(); ++column) use(matrix(row, column));
  }
}

std::vector<std::uint8_t> packPose(const ImageGeometry& geometry) {
  std::vector<std::uint8_t> bytes(kPoseBytes);
  std::uint8_t* to = bytes.data();
  const Eigen::Vector3d& position_m = geometry.camera.position_m;
  const Eigen::Quaterniond& q = geometry.camera.rotation;
  for (const double value : {position_m.x(), position_m.y(), position_m.z(), q.w(), q.x(), q.y(), q.z()}) {
    putDouble(value, to);
    to += sizeof(value);
  }
  forUpperTriangle(geometry.covariance, [&to](double value) {
    putFloat(static_cast<float>(value), to);
    to += sizeof(float);
  });
  return bytes;
}

void unpackPose(const std::uint8_t* from, ImageGeometry& geometry) {
  std::array<double, 7> values{};
  for (double& value : values) {
    value = getDouble(from);
    from += sizeof(value);
  }
  geometry.camera.position_m = {values[0], values[1], values[2]};
  geometry.camera.rotation = {values[3], values[4], values[5], values[6]};
  forUpperTriangle(geometry.covariance, [&from](double& value) {
    value = getFloat(from);
    from += sizeof(float);
  });
  geometry.covariance.triangularView<Eigen::StrictlyLower>() = geometry.covariance.transpose().eval();
}

void packLandmark(const SeenLandmark& landmark, bool is_short, std::uint8_t* to) {
  if (is_short) {
    putLittleEndian(static_cast<std::uint16_t>(landmark.feature), to);
  } else {
    putLittleEndian(landmark.feature, to);
  }
  to += is_short ? 2 : 4;
  putLittleEndian(landmark.id, to);
  for (Eigen::Index axis = 0; axis < 3; ++axis) putFloat(landmark.offset_m[axis], to + 4 + 4 * axis);
  to[16] = sigmaClass(landmark.sigma_along_m);
  to[17] = sigmaClass(landmark.sigma_across_m);
}

SeenLandmark unpackLandmark(const std::uint8_t* from, bool is_short) {
  SeenLandmark landmark;
  landmark.feature = is_short ? getLittleEndian<std::uint16_t>(from) : getLittleEndian<std::uint32_t>(from);
  from += is_short ? 2 : 4;
  landmark.id = getLittleEndian<std::uint32_t>(from);
  landmark.offset_m = {getFloat(from + 4), getFloat(from + 8), getFloat(from + 12)};
  landmark.sigma_along_m = sigmaOf(from[16]);
  landmark.sigma_across_m = sigmaOf(from[17]);
  return landmark;
}

}  // namespace

PackedGeometry packGeometry(const ImageGeometry& geometry, std::size_t feature_count) {
  ImageGeometry rounded = geometry;
  requireUsable(rounded, feature_count);
  rounded.covariance = geometry.covariance.cast<float>().cast<double>();
  requireUsable(rounded, feature_count);
  const std::size_t each = landmarkBytes(feature_count);
  PackedGeometry packed{packPose(rounded), std::vector<std::uint8_t>(geometry.landmarks.size() * each)};
  std::uint8_t* to = packed.points.data();
  for (const SeenLandmark& landmark : geometry.landmarks) {
    packLandmark(landmark, feature_count <= kMostShortIndices, to);
    to += each;
  }
  return packed;
}

ImageGeometry unpackGeometry(sqlite::Bytes pose, sqlite::Bytes points, std::size_t feature_count) {
  const std::size_t each = landmarkBytes(feature_count);
  if (pose.size != kPoseBytes) throw std::runtime_error("the pose of a camera has a wrong size");
  if (points.size % each != 0) throw std::runtime_error("a landmark is incomplete");
  if (points.size / each > feature_count) throw std::runtime_error("there are more landmarks than features");
  ImageGeometry geometry;
  unpackPose(pose.data, geometry);
  geometry.landmarks.reserve(points.size / each);
  for (std::size_t at = 0; at < points.size; at += each) {
    geometry.landmarks.push_back(unpackLandmark(points.data + at, feature_count <= kMostShortIndices));
  }
  requireUsable(geometry, feature_count);
  return geometry;
}

std::uint8_t sigmaClass(float sigma_m) {
  const auto found = std::lower_bound(sigmas().begin(), sigmas().end() - 1, sigma_m);
  return static_cast<std::uint8_t>(found - sigmas().begin());
}

float sigmaOf(std::uint8_t sigma_class) { return sigmas()[sigma_class]; }

}  // namespace visual_localization::map_schema

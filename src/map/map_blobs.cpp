#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>
#include <utility>

#include "map/map_geometry.h"
#include "map/map_schema.h"

namespace visual_localization::map_schema {

static_assert(kPoseBytes + kMaxFeaturesPerImage * landmarkBytes(kMaxFeaturesPerImage) <= kMaxRowBytes);

std::vector<std::uint8_t> packMask(const Mask& mask) {
  std::vector<std::uint8_t> bytes((mask.grey().total() + 7) / 8);
  std::size_t pixel = 0;
  for (int row = 0; row < mask.grey().rows; ++row) {
    for (int column = 0; column < mask.grey().cols; ++column, ++pixel) {
      const unsigned bit = mask.grey().at<std::uint8_t>(row, column) != 0 ? 0x80U : 0U;
      bytes[pixel / 8] = static_cast<std::uint8_t>(bytes[pixel / 8] | bit >> (pixel % 8));
    }
  }
  return bytes;
}

Mask unpackMask(sqlite::Bytes bytes, const cv::Size& size) {
  const auto pixels = static_cast<std::size_t>(size.area());
  if (bytes.size != (pixels + 7) / 8) {
    throw std::runtime_error("a mask has " + std::to_string(bytes.size) + " bytes instead of " +
                             std::to_string((pixels + 7) / 8));
  }
  cv::Mat grey(size, CV_8U);
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    grey.data[pixel] = (bytes.data[pixel / 8] << (pixel % 8) & 0x80) != 0 ? 255 : 0;
  }
  return Mask(grey);
}

std::vector<std::uint8_t> packKeypoints(const Keypoints& keypoints) {
  std::vector<std::uint8_t> bytes(keypoints.size() * kKeypointBytes);
  std::uint8_t* to = bytes.data();
  for (const Keypoint& keypoint : keypoints) {
    for (const float value : {keypoint.x_px, keypoint.y_px, keypoint.size_px, keypoint.angle_deg}) {
      putReal<float>(value, to);
      to += sizeof(float);
    }
  }
  return bytes;
}

Keypoints unpackKeypoints(sqlite::Bytes bytes) {
  const std::size_t count = bytes.size / kKeypointBytes;
  Keypoints keypoints;
  keypoints.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint8_t* from = bytes.data + i * kKeypointBytes;
    const Keypoint keypoint{getReal<float>(from), getReal<float>(from + 4), getReal<float>(from + 8),
                            getReal<float>(from + 12)};
    for (const float value : {keypoint.x_px, keypoint.y_px, keypoint.size_px, keypoint.angle_deg}) {
      if (!std::isfinite(value)) throw std::runtime_error("a keypoint is not finite");
    }
    keypoints.push_back(keypoint);
  }
  return keypoints;
}

std::vector<std::uint8_t> packHistogram(const GlobalFeatures::Histogram& histogram) {
  std::vector<std::uint8_t> bytes(kHistogramBytes);
  for (std::size_t i = 0; i < histogram.size(); ++i) putReal<float>(histogram[i], &bytes[i * sizeof(float)]);
  return bytes;
}

GlobalFeatures::Histogram unpackHistogram(sqlite::Bytes bytes) {
  if (bytes.size != kHistogramBytes) throw std::runtime_error("a global descriptor has a wrong size");
  GlobalFeatures::Histogram histogram{};
  for (std::size_t i = 0; i < histogram.size(); ++i) {
    histogram[i] = getReal<float>(bytes.data + i * sizeof(float));
    if (!(std::isfinite(histogram[i]) && histogram[i] >= 0.0F)) {
      throw std::runtime_error("a global descriptor is not finite or negative");
    }
  }
  return histogram;
}

namespace {

constexpr std::size_t kVocabularyHead = 4;  ///< bytes: numbers of components and axes

template <class Table>
void packFloats(const Table& table, std::vector<std::uint8_t>& bytes) {
  const std::size_t begin = bytes.size();
  bytes.resize(begin + static_cast<std::size_t>(table.size()) * sizeof(float));
  for (Eigen::Index i = 0; i < table.size(); ++i) {
    putReal<float>(table.data()[i], &bytes[begin + static_cast<std::size_t>(i) * sizeof(float)]);
  }
}

template <class Table>
const std::uint8_t* unpackFloats(const std::uint8_t* from, Table& table) {
  for (Eigen::Index i = 0; i < table.size(); ++i) table.data()[i] = getReal<float>(from + sizeof(float) * i);
  return from + sizeof(float) * table.size();
}

}  // namespace

std::vector<std::uint8_t> packVocabulary(const VladVocabulary& vocabulary) {
  const VladVocabulary::Tables& tables = vocabulary.tables();
  std::vector<std::uint8_t> bytes(kVocabularyHead);
  putLittleEndian(static_cast<std::uint16_t>(tables.components.cols()), bytes.data());
  putLittleEndian(static_cast<std::uint16_t>(tables.axes.cols()), bytes.data() + 2);
  packFloats(tables.words, bytes);
  packFloats(tables.components, bytes);
  packFloats(tables.mean, bytes);
  packFloats(tables.scales, bytes);
  const auto* axes = reinterpret_cast<const std::uint8_t*>(tables.axes.data());
  bytes.insert(bytes.end(), axes, axes + tables.axes.size());
  return bytes;
}

std::shared_ptr<const VladVocabulary> unpackVocabulary(sqlite::Bytes bytes, std::size_t dimension,
                                                       cv::Size image_size) {
  if (bytes.size < kVocabularyHead) throw std::runtime_error("the vocabulary is incomplete");
  const Eigen::Index components = getLittleEndian<std::uint16_t>(bytes.data);
  const Eigen::Index axes = getLittleEndian<std::uint16_t>(bytes.data + 2);
  const auto rows = static_cast<Eigen::Index>(dimension);
  const Eigen::Index sums = VladVocabulary::kBlocks * components;
  const Eigen::Index floats = rows * (VladVocabulary::kWords + components) + sums + axes;
  const auto expected =
      kVocabularyHead + sizeof(float) * static_cast<std::size_t>(floats) + static_cast<std::size_t>(sums * axes);
  if (bytes.size != expected) {
    throw std::runtime_error("the vocabulary has " + std::to_string(bytes.size) + " bytes instead of " +
                             std::to_string(expected));
  }
  VladVocabulary::Tables tables;
  tables.words.resize(rows, VladVocabulary::kWords);
  tables.components.resize(rows, components);
  tables.mean.resize(sums);
  tables.scales.resize(axes);
  tables.axes.resize(sums, axes);
  const std::uint8_t* from = unpackFloats(bytes.data + kVocabularyHead, tables.words);
  from = unpackFloats(from, tables.components);
  from = unpackFloats(from, tables.mean);
  from = unpackFloats(from, tables.scales);
  std::memcpy(tables.axes.data(), from, static_cast<std::size_t>(tables.axes.size()));
  return std::make_shared<const VladVocabulary>(std::move(tables), image_size);
}

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
    putReal<double>(value, to);
    to += sizeof(value);
  }
  forUpperTriangle(geometry.covariance, [&to](double value) {
    putReal<float>(static_cast<float>(value), to);
    to += sizeof(float);
  });
  return bytes;
}

void unpackPose(const std::uint8_t* from, ImageGeometry& geometry) {
  std::array<double, 7> values{};
  for (double& value : values) {
    value = getReal<double>(from);
    from += sizeof(value);
  }
  geometry.camera.position_m = {values[0], values[1], values[2]};
  geometry.camera.rotation = {values[3], values[4], values[5], values[6]};
  forUpperTriangle(geometry.covariance, [&from](double& value) {
    value = getReal<float>(from);
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
  for (Eigen::Index axis = 0; axis < 3; ++axis) putReal<float>(landmark.offset_m[axis], to + 4 + 4 * axis);
  to[16] = sigmaClass(landmark.sigma_along_m);
  to[17] = sigmaClass(landmark.sigma_across_m);
}

SeenLandmark unpackLandmark(const std::uint8_t* from, bool is_short) {
  SeenLandmark landmark;
  landmark.feature = is_short ? getLittleEndian<std::uint16_t>(from) : getLittleEndian<std::uint32_t>(from);
  from += is_short ? 2 : 4;
  landmark.id = getLittleEndian<std::uint32_t>(from);
  landmark.offset_m = {getReal<float>(from + 4), getReal<float>(from + 8), getReal<float>(from + 12)};
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

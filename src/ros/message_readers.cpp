#include "ros/message_readers.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <sstream>
#include <stdexcept>
#include <utility>

#include <Eigen/Geometry>
#include <camera_calibration_parsers/parse_ini.h>
#include <camera_calibration_parsers/parse_yml.h>
#include <image_transport/camera_common.h>

#include "base/files.h"
#include "base/text.h"
#include "camera/lens_names.h"
#include "parameters/yaml_map.h"

namespace visual_localization {
namespace {

constexpr std::size_t kLargestFile_bytes = 65536;  ///< a calibration has one or two thousand
constexpr std::size_t kMostCoefficients = 14;      ///< of any of OpenCV's models
constexpr std::uint32_t kMostBinned = 64;
constexpr std::uint32_t kLargestSide_px = 32768;

template <class Matrix>
bool isZero(const Matrix& matrix) {
  return std::all_of(matrix.begin(), matrix.end(), [](double value) { return value == 0.0; });
}

void requireValue(bool condition, const std::string& what) {
  if (!condition) throw CameraError(what);
}

std::string text(double value) {
  std::ostringstream out = numberStream(6);
  out << value;
  return out.str();
}

template <class Matrix>
void requireElement(const Matrix& matrix, const char* name, std::size_t columns, std::size_t row, std::size_t column,
                    double value) {
  const double found = matrix[row * columns + column];
  requireValue(found == value, std::string(name) + "[" + std::to_string(row * columns + column) + "] = " + text(found) +
                                   ", must be " + text(value) + ": no camera matrix");
}

/// From K (3 columns) or P (4), whose other elements must be a camera's.
template <class Matrix>
void readMatrix(const Matrix& matrix, const char* name, std::size_t columns, Intrinsics& camera) {
  requireElement(matrix, name, columns, 0, 1, 0.0);
  requireElement(matrix, name, columns, 1, 0, 0.0);
  requireElement(matrix, name, columns, 2, 0, 0.0);
  requireElement(matrix, name, columns, 2, 1, 0.0);
  requireElement(matrix, name, columns, 2, 2, 1.0);
  camera.fx = matrix[0];
  camera.cx = matrix[2];
  camera.fy = matrix[columns + 1];
  camera.cy = matrix[columns + 2];
}

void requireFull(const sensor_msgs::CameraInfo& info) {
  requireValue(info.width >= 1 && info.width <= kLargestSide_px && info.height >= 1 && info.height <= kLargestSide_px,
               "the image size " + std::to_string(info.width) + " x " + std::to_string(info.height) +
                   " is not in [1, " + std::to_string(kLargestSide_px) + "]");
}

/// A region of no size is the whole image.
void cutOut(const sensor_msgs::CameraInfo& info, Intrinsics& camera) {
  const auto& roi = info.roi;
  if (roi.width == 0 && roi.height == 0) return;
  const bool inside = roi.width >= 1 && roi.height >= 1 && roi.x_offset <= info.width && roi.y_offset <= info.height &&
                      roi.width <= info.width - roi.x_offset && roi.height <= info.height - roi.y_offset;
  requireValue(inside, "the region of interest " + std::to_string(roi.width) + " x " + std::to_string(roi.height) +
                           " at (" + std::to_string(roi.x_offset) + ", " + std::to_string(roi.y_offset) +
                           ") is not in the image of " + std::to_string(info.width) + " x " +
                           std::to_string(info.height));
  camera.size = {static_cast<int>(roi.width), static_cast<int>(roi.height)};
  camera.cx -= roi.x_offset;
  camera.cy -= roi.y_offset;
}

/// 0 means the same as 1.
void bin(std::uint32_t binning, int& side_px, double& focal_length, double& centre) {
  if (binning <= 1) return;
  requireValue(binning <= kMostBinned, "binning " + std::to_string(binning) + " is not in [0, 64]");
  side_px /= static_cast<int>(binning);
  focal_length /= binning;
  centre = (centre + 0.5) / binning - 0.5;
}

using parameters::YamlMap;

/// What camera_calibration_parsers takes for granted and does not check.
std::size_t requireMatrix(YamlMap& file, const std::string& key, std::size_t rows, std::size_t columns) {
  YamlMap matrix = file.map(key);
  const auto side = [&matrix](const char* name, std::size_t most) {
    if (!matrix.has(name)) matrix.refuse(name, "is missing");
    return matrix.count(name, 0, 0, most);
  };
  const bool any_size = rows == 0;
  const std::size_t found_rows = side("rows", kMostCoefficients);
  const std::size_t found_columns = side("cols", kMostCoefficients);
  if (!any_size && (found_rows != rows || found_columns != columns)) {
    file.refuse(key, "must have " + std::to_string(rows) + " rows and " + std::to_string(columns) + " columns");
  }
  if (matrix.numbers("data", found_rows * found_columns) != found_rows * found_columns) {
    file.refuse(key, "must have as many values in 'data' as 'rows' times 'cols'");
  }
  return found_rows * found_columns;
}

/// A file of camera_calibration, checked; or one of OpenCV, which has the same names but neither all of them nor the
/// first line of YAML, with what camera_calibration would add.
std::string completed(std::string text, const std::string& path) {
  constexpr std::size_t kPlumbBob = 5;
  if (text.compare(0, 6, "%YAML:") == 0) text.erase(0, text.find('\n'));
  YamlMap file = YamlMap::parse(text, path);
  for (const char* side : {"image_width", "image_height"}) {
    if (!file.has(side)) file.refuse(side, "is missing");
    file.count(side, 0, 1, kLargestSide_px);
  }
  requireMatrix(file, "camera_matrix", 3, 3);
  const bool wide = requireMatrix(file, "distortion_coefficients", 0, 0) > kPlumbBob;
  const auto complete = [&](const std::string& key, const std::string& value) {
    if (!file.has(key)) text += '\n' + key + ": " + value + '\n';
    return file.has(key);
  };
  if (complete("camera_name", "camera")) file.text("camera_name");
  if (complete("distortion_model", wide ? "rational_polynomial" : "plumb_bob")) file.text("distortion_model");
  if (complete("rectification_matrix", "{rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}"))
    requireMatrix(file, "rectification_matrix", 3, 3);
  if (complete("projection_matrix", "{rows: 3, cols: 4, data: [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]}"))
    requireMatrix(file, "projection_matrix", 3, 4);
  return text;
}

bool endsIn(const std::string& text, const std::string& ending) {
  return text.size() > ending.size() && text.compare(text.size() - ending.size(), ending.size(), ending) == 0;
}

sensor_msgs::CameraInfo parse(const std::string& content, const std::string& path) {
  const bool yaml = endsIn(path, ".yaml") || endsIn(path, ".yml");
  requireValue(yaml || endsIn(path, ".ini"), "must end in .yaml, .yml or .ini");
  sensor_msgs::CameraInfo info;
  std::string name;
  std::istringstream in(yaml ? completed(content, path) : content);
  const bool parsed = yaml ? camera_calibration_parsers::readCalibrationYml(in, name, info)
                           : camera_calibration_parsers::parseCalibrationIni(content, name, info);
  requireValue(parsed, "is no camera calibration");
  return info;
}

}  // namespace

bool isCalibrated(const sensor_msgs::CameraInfo& info, bool rectified) {
  return rectified ? !isZero(info.P) : !isZero(info.K);
}

std::optional<CameraModel> toCamera(const sensor_msgs::CameraInfo& info, bool rectified) {
  if (!isCalibrated(info, rectified)) return std::nullopt;
  requireFull(info);
  Intrinsics camera;
  camera.size = {static_cast<int>(info.width), static_cast<int>(info.height)};
  if (rectified) {
    readMatrix(info.P, "P", 4, camera);
  } else {
    readMatrix(info.K, "K", 3, camera);
    Lens lens = lensOf(info.distortion_model, info.D);
    camera.distortion = lens.distortion;
    camera.coefficients = std::move(lens.coefficients);
  }
  cutOut(info, camera);
  bin(info.binning_x, camera.size.width, camera.fx, camera.cx);
  bin(info.binning_y, camera.size.height, camera.fy, camera.cy);
  return CameraModel(camera);
}

sensor_msgs::CameraInfo toMessage(const CameraModel& camera) {
  const Intrinsics& intrinsics = camera.intrinsics();
  sensor_msgs::CameraInfo info;
  info.width = static_cast<std::uint32_t>(intrinsics.size.width);
  info.height = static_cast<std::uint32_t>(intrinsics.size.height);
  info.distortion_model = toString(intrinsics.distortion);
  info.D = intrinsics.coefficients;
  info.K = {intrinsics.fx, 0.0, intrinsics.cx, 0.0, intrinsics.fy, intrinsics.cy, 0.0, 0.0, 1.0};
  info.R = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  info.P = {intrinsics.fx, 0.0, intrinsics.cx, 0.0, 0.0, intrinsics.fy, intrinsics.cy, 0.0, 0.0, 0.0, 1.0, 0.0};
  return info;
}

namespace {

/// Some drivers compute a calibration anew for each image; at 10 000 pixels this is a hundredth of one.
constexpr double kCalibrationRounding = 1e-6;

template <class Numbers>
bool almostEqual(const Numbers& a, const Numbers& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](double x, double y) {
    return std::abs(x - y) <= kCalibrationRounding * std::max({1.0, std::abs(x), std::abs(y)});
  });
}

}  // namespace

bool sameCalibration(const sensor_msgs::CameraInfo& a, const sensor_msgs::CameraInfo& b) {
  return a.width == b.width && a.height == b.height && a.distortion_model == b.distortion_model &&
         almostEqual(a.D, b.D) && almostEqual(a.K, b.K) && almostEqual(a.P, b.P) && a.binning_x == b.binning_x &&
         a.binning_y == b.binning_y && a.roi.x_offset == b.roi.x_offset && a.roi.y_offset == b.roi.y_offset &&
         a.roi.width == b.roi.width && a.roi.height == b.roi.height;
}

bool SingleCalibration::add(const sensor_msgs::CameraInfo& info) {
  if (first_) return !isCalibrated(info, rectified_) || sameCalibration(info, *first_);
  camera_ = toCamera(info, rectified_);
  if (camera_) first_ = info;
  return true;
}

CameraModel readCameraFile(const std::string& path) {
  try {
    return parseCameraFile(readFile(path, kLargestFile_bytes), path);
  } catch (const FileError& error) {
    throw CameraError(oneLine(error.what()));
  }
}

CameraModel parseCameraFile(const std::string& content, const std::string& path) {
  try {
    const std::optional<CameraModel> camera = toCamera(parse(content, path));
    if (!camera) throw CameraError("is not calibrated: its camera matrix is zero");
    return *camera;
  } catch (const ParameterError& error) {
    throw CameraError(oneLine(error.what()));
  } catch (const std::exception& error) {
    throw CameraError(path + ": " + oneLine(error.what()));
  }
}

std::string cameraInfoTopic(const std::string& image_topic) {
  const std::string compressed = "/compressed";
  const std::size_t kept = image_topic.size() - (endsIn(image_topic, compressed) ? compressed.size() : 0);
  return image_transport::getCameraInfoTopic(image_topic.substr(0, kept));
}

bool isRectified(const std::string& image_topic) { return image_topic.find("/image_rect") != std::string::npos; }

namespace {

double sigmaOf(const sensor_msgs::NavSatFix& message, double variance_m2) {
  const bool unknown = message.position_covariance_type == sensor_msgs::NavSatFix::COVARIANCE_TYPE_UNKNOWN;
  return unknown ? 0.0 : deviationOf(variance_m2);
}

}  // namespace

double deviationOf(double variance_m2) {
  constexpr double kUnknown_m2 = 9999.0;
  return variance_m2 > 0.0 && variance_m2 < kUnknown_m2 ? std::sqrt(variance_m2) : 0.0;
}

Fix toFix(const sensor_msgs::NavSatFix& message, std::int64_t stamp_ns) {
  return {stamp_ns,
          {message.latitude, message.longitude, message.altitude},
          message.status.status >= sensor_msgs::NavSatStatus::STATUS_FIX,
          sigmaOf(message, 0.5 * (message.position_covariance[0] + message.position_covariance[4])),
          sigmaOf(message, message.position_covariance[8])};
}

OdometryReading toReading(const nav_msgs::Odometry& message, std::int64_t stamp_ns, const std::string& base_frame,
                          const std::string& map_frame) {
  constexpr double kRounding = 0.01;
  const auto& p = message.pose.pose.position;
  const auto& q = message.pose.pose.orientation;
  const Eigen::Quaterniond rotation(q.w, q.x, q.y, q.z);
  if (!std::isfinite(p.x) || !std::isfinite(p.y) || !rotation.coeffs().allFinite()) {
    throw std::invalid_argument("its pose is not finite");
  }
  if (std::abs(rotation.norm() - 1.0) > kRounding) throw std::invalid_argument("its orientation is no unit quaternion");
  const std::string child = withoutSlash(message.child_frame_id);
  if (!child.empty() && child != base_frame) {
    throw std::invalid_argument("its child_frame_id is '" + oneLine(child, 100) + "' instead of '" + base_frame + "'");
  }
  if (withoutSlash(message.header.frame_id) == map_frame) {
    throw std::invalid_argument("its frame_id is '" + map_frame + "', which is the map's");
  }
  const Eigen::Vector3d ahead = rotation * Eigen::Vector3d::UnitX();
  return {stamp_ns, {p.x, p.y}, std::atan2(ahead.y(), ahead.x())};
}

}  // namespace visual_localization

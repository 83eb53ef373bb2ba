#include "visual_localization/camera/camera_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <opencv2/calib3d.hpp>

#include "base/numbers.h"
#include "base/text.h"

/// The equations of the lens models (OpenCV's documentation of calib3d), on normalised coordinates.
namespace visual_localization::lens {
namespace {

constexpr double kWidestAngle_rad = toRadians(85.0);

double at(const std::vector<double>& coefficients, std::size_t i) {
  return i < coefficients.size() ? coefficients[i] : 0.0;
}

/// Angle on the sensor of a ray `theta` from the axis (Kannala and Brandt).
double fisheyeAngle(const std::vector<double>& k, double theta) {
  const double t2 = theta * theta;
  return theta * (1.0 + t2 * (at(k, 0) + t2 * (at(k, 1) + t2 * (at(k, 2) + t2 * at(k, 3)))));
}

/// What a radius is multiplied with (Brown and Conrady, with the denominator of the rational model).
double radialFactor(const std::vector<double>& k, double r2) {
  const double numerator = 1.0 + r2 * (at(k, 0) + r2 * (at(k, 1) + r2 * at(k, 4)));
  const double denominator = 1.0 + r2 * (at(k, 5) + r2 * (at(k, 6) + r2 * at(k, 7)));
  return denominator > 0.0 ? numerator / denominator : -1.0;
}

double distortedRadius(Distortion model, const std::vector<double>& coefficients, double angle_rad) {
  if (model == Distortion::kEquidistant) return fisheyeAngle(coefficients, angle_rad);
  const double radius = std::tan(angle_rad);
  return radius * radialFactor(coefficients, radius * radius);
}

/// Of an undistorted ray. Meaningless beyond widestRadius().
Eigen::Vector2d distort(Distortion model, const std::vector<double>& k, const Eigen::Vector2d& normalised) {
  const double r2 = normalised.squaredNorm();
  if (model == Distortion::kEquidistant) {
    const double r = std::sqrt(r2);
    return r > 0.0 ? Eigen::Vector2d(normalised * (fisheyeAngle(k, std::atan(r)) / r)) : normalised;
  }
  const double x = normalised.x();
  const double y = normalised.y();
  const double p1 = at(k, 2);
  const double p2 = at(k, 3);
  const Eigen::Vector2d tangential(2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
                                   p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y);
  return normalised * radialFactor(k, r2) + tangential;
}

/// Up to which length of normalised coordinates the distorted radius grows with the undistorted one, at most that of
/// a ray 85 degrees from the axis. Tangential coefficients are left aside.
double widestRadius(Distortion model, const std::vector<double>& coefficients) {
  constexpr int kSteps = 1700;  // of a twentieth of a degree
  double angle_rad = 0.0;
  double radius = 0.0;
  for (int i = 1; i <= kSteps; ++i) {
    const double next_rad = kWidestAngle_rad * i / kSteps;
    const double next = distortedRadius(model, coefficients, next_rad);
    if (!(next > radius)) break;
    angle_rad = next_rad;
    radius = next;
  }
  return std::tan(angle_rad);
}

/// By OpenCV, iteratively. Where it does not converge, anything; check by distort().
std::vector<Eigen::Vector2d> undistort(Distortion model, const std::vector<double>& coefficients,
                                       const std::vector<Eigen::Vector2d>& distorted) {
  if (distorted.empty()) return {};
  std::vector<Eigen::Vector2d> normalised(distorted.size());
  static_assert(sizeof(Eigen::Vector2d) == 2 * sizeof(double), "OpenCV reads and writes these points in place");
  const auto count = static_cast<int>(distorted.size());
  const cv::Mat from(count, 1, CV_64FC2, const_cast<Eigen::Vector2d*>(distorted.data()));  // only read
  cv::Mat to(count, 1, CV_64FC2, normalised.data());
  const cv::Matx33d identity = cv::Matx33d::eye();
  if (model == Distortion::kEquidistant) {
    cv::fisheye::undistortPoints(from, to, identity, coefficients);
  } else {
    // Its own five iterations leave errors of pixels in the corners of a wide lens.
    const cv::TermCriteria until(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 100, 1e-10);
    cv::undistortPoints(from, to, identity, coefficients, cv::noArray(), cv::noArray(), until);
  }
  CV_Assert(to.ptr() == reinterpret_cast<const unsigned char*>(normalised.data()));  // not allocated anew
  return normalised;
}

}  // namespace
}  // namespace visual_localization::lens

namespace visual_localization {
namespace {

constexpr int kLargestSide_px = 32768;
constexpr double kShortestFocalLength = 0.1;  ///< image sides
constexpr double kLongestFocalLength = 100.0;
constexpr double kFarthestPrincipalPoint = 0.5;  ///< image sides outside the image
constexpr double kLargestCoefficient = 1e6;
constexpr double kRounding = 1e-9;  ///< relative: a camera that was scaled is still allowed
/// How far distort() may miss what was undistorted, normalised: at 300 pixels of focal length 0.003 pixels.
constexpr double kRoundTrip = 1e-5;

std::string text(double value) {
  std::ostringstream out = numberStream(6);
  out << value;
  return out.str();
}

void requireIn(const std::string& field, double value, double least, double most) {
  const double slack = kRounding * std::max(std::abs(least), std::abs(most));
  if (value >= least - slack && value <= most + slack) return;  // not so for NaN
  throw CameraError(field + " = " + text(value) + " is not in [" + text(least) + ", " + text(most) + "]");
}

void requireSize(const cv::Size& size) {
  requireIn("image width", size.width, 1, kLargestSide_px);
  requireIn("image height", size.height, 1, kLargestSide_px);
}

/// Along one axis of the image. Ranges are in image sides, so that they hold for the scaled camera as well.
void requireAxis(const std::string& axis, double focal_length, double centre, int side_px) {
  requireIn("f" + axis, focal_length, kShortestFocalLength * side_px, kLongestFocalLength * side_px);
  const double outside_px = kFarthestPrincipalPoint * side_px;
  requireIn("c" + axis, centre, -outside_px - 0.5, side_px + outside_px - 0.5);
}

void requireCoefficients(Distortion distortion, const std::vector<double>& coefficients) {
  const std::size_t count = coefficients.size();
  const bool plumb_bob = distortion == Distortion::kPlumbBob;
  const bool fits =
      plumb_bob ? count == 0 || count == 4 || count == 5 : count == (distortion == Distortion::kEquidistant ? 4U : 8U);
  if (!fits) {
    const char* allowed = plumb_bob ? "0, 4 or 5" : distortion == Distortion::kEquidistant ? "4" : "8";
    throw CameraError("the distortion model " + toString(distortion) + " takes " + allowed + " coefficients, not " +
                      std::to_string(count));
  }
  for (std::size_t i = 0; i < count; ++i) {
    requireIn("distortion coefficient " + std::to_string(i), coefficients[i], -kLargestCoefficient,
              kLargestCoefficient);
  }
}

constexpr int kGrid = 16;  ///< cells along each side of the image

/// Corners of the grid's cells from `first` to `last` along both sides, row by row.
std::vector<Eigen::Vector2d> pixelGrid(const cv::Size& size, int first, int last) {
  std::vector<Eigen::Vector2d> pixels;
  for (int row = first; row <= last; ++row) {
    for (int column = first; column <= last; ++column) {
      pixels.emplace_back(size.width * column / double{kGrid} - 0.5, size.height * row / double{kGrid} - 0.5);
    }
  }
  return pixels;
}

/// In the middle half of the image's width and height.
void requireUndistortion(const CameraModel& camera) {
  const std::vector<Eigen::Vector2d> pixels = pixelGrid(camera.size(), kGrid / 4, 3 * kGrid / 4);
  const std::vector<Eigen::Vector2d> rays = camera.undistort(pixels);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (rays[i].allFinite()) continue;
    throw CameraError("the distortion cannot be undone at pixel (" + text(pixels[i].x()) + ", " + text(pixels[i].y()) +
                      "), which is in the middle of the image: the coefficients do not describe this camera");
  }
}

Eigen::Vector2d nothing() { return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN()); }

}  // namespace

CameraModel::CameraModel(const Intrinsics& intrinsics) : intrinsics_(intrinsics) {
  requireSize(size());
  requireAxis("x", intrinsics_.fx, intrinsics_.cx, size().width);
  requireAxis("y", intrinsics_.fy, intrinsics_.cy, size().height);
  requireCoefficients(intrinsics_.distortion, intrinsics_.coefficients);
  const std::vector<double>& coefficients = intrinsics_.coefficients;
  pinhole_ = intrinsics_.distortion != Distortion::kEquidistant &&
             std::all_of(coefficients.begin(), coefficients.end(), [](double value) { return value == 0.0; });
  widest_ = pinhole_ ? std::tan(lens::kWidestAngle_rad) : lens::widestRadius(intrinsics_.distortion, coefficients);
  if (!pinhole_) requireUndistortion(*this);
}

double CameraModel::usableShare() const {
  if (pinhole_) return 1.0;
  const std::vector<Eigen::Vector2d> rays = undistort(pixelGrid(size(), 0, kGrid));
  const auto usable =
      std::count_if(rays.begin(), rays.end(), [](const Eigen::Vector2d& ray) { return ray.allFinite(); });
  return static_cast<double>(usable) / static_cast<double>(rays.size());
}

CameraModel CameraModel::scaledTo(const cv::Size& size) const {
  if (size == intrinsics_.size) return *this;
  requireSize(size);
  const double x = static_cast<double>(size.width) / intrinsics_.size.width;
  const double y = static_cast<double>(size.height) / intrinsics_.size.height;
  CameraModel scaled = *this;
  scaled.intrinsics_.size = size;
  scaled.intrinsics_.fx *= x;
  scaled.intrinsics_.fy *= y;
  scaled.intrinsics_.cx = (intrinsics_.cx + 0.5) * x - 0.5;
  scaled.intrinsics_.cy = (intrinsics_.cy + 0.5) * y - 0.5;
  return scaled;
}

std::vector<Eigen::Vector2d> CameraModel::undistort(const std::vector<Eigen::Vector2d>& pixels) const {
  std::vector<Eigen::Vector2d> rays(pixels.size());
  std::transform(pixels.begin(), pixels.end(), rays.begin(), [this](const Eigen::Vector2d& pixel) {
    return Eigen::Vector2d((pixel.x() - intrinsics_.cx) / intrinsics_.fx,
                           (pixel.y() - intrinsics_.cy) / intrinsics_.fy);
  });
  return pinhole_ ? rays : undistorted(rays);
}

std::vector<Eigen::Vector2d> CameraModel::undistorted(const std::vector<Eigen::Vector2d>& distorted) const {
  std::vector<Eigen::Vector2d> rays = lens::undistort(intrinsics_.distortion, intrinsics_.coefficients, distorted);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const bool usable = rays[i].norm() <= widest_ && (this->distorted(rays[i]) - distorted[i]).norm() <= kRoundTrip;
    if (!usable) rays[i] = nothing();
  }
  return rays;
}

Eigen::Vector2d CameraModel::project(const Eigen::Vector3d& in_camera) const {
  if (!(in_camera.z() > 0.0)) return nothing();
  return distort(in_camera.head<2>() / in_camera.z());
}

Eigen::Vector2d CameraModel::distort(const Eigen::Vector2d& normalised) const {
  if (!(normalised.norm() <= widest_)) return nothing();
  const Eigen::Vector2d point = distorted(normalised);
  return {intrinsics_.fx * point.x() + intrinsics_.cx, intrinsics_.fy * point.y() + intrinsics_.cy};
}

Eigen::Vector2d CameraModel::distorted(const Eigen::Vector2d& normalised) const {
  return pinhole_ ? normalised : lens::distort(intrinsics_.distortion, intrinsics_.coefficients, normalised);
}

// Cameras as words and as named values.

namespace {

constexpr std::array<std::pair<Distortion, const char*>, 3> kNames = {
    {{Distortion::kPlumbBob, "plumb_bob"},
     {Distortion::kRationalPolynomial, "rational_polynomial"},
     {Distortion::kEquidistant, "equidistant"}}};

constexpr std::size_t kMostCoefficients = 8;

using Number = std::pair<const char*, double Intrinsics::*>;
constexpr std::array<Number, 4> kNumbers = {
    {{"fx", &Intrinsics::fx}, {"fy", &Intrinsics::fy}, {"cx", &Intrinsics::cx}, {"cy", &Intrinsics::cy}}};

std::string text(const cv::Size& size) { return std::to_string(size.width) + " x " + std::to_string(size.height); }

/// Focal lengths to a tenth of a pixel.
std::string tenths(double value) { return text(std::round(10.0 * value) / 10.0); }

std::string coefficientsOf(const Intrinsics& camera) {
  std::vector<std::string> numbers;
  for (const double value : camera.coefficients) numbers.push_back(text(value));
  return "(" + joined(numbers) + ")";
}

/// Removes `key` from `values` and returns its value.
template <class T>
T take(ParameterValues& values, const std::string& key) {
  const auto found = values.find(key);
  if (found == values.end()) throw CameraError("value '" + key + "' is missing");
  const T* value = std::get_if<T>(&found->second);
  if (value == nullptr) throw CameraError("value '" + key + "' is of the wrong type");
  T taken = *value;
  values.erase(found);
  return taken;
}

int takeSide(ParameterValues& values, const std::string& key) {
  const auto side = take<std::int64_t>(values, key);
  if (side < 1 || side > std::numeric_limits<int>::max()) {
    throw CameraError(key + " = " + std::to_string(side) + " is no image side");
  }
  return static_cast<int>(side);
}

}  // namespace

std::string toString(Distortion distortion) {
  for (const auto& [model, name] : kNames) {
    if (model == distortion) return name;
  }
  throw CameraError("unknown distortion model " + std::to_string(static_cast<int>(distortion)));
}

Distortion distortionOf(const std::string& name) {
  for (const auto& [model, known] : kNames) {
    if (name == known) return model;
  }
  throw CameraError("unknown distortion model '" + oneLine(name, 60) +
                    "', allowed: plumb_bob, rational_polynomial, equidistant");
}

bool operator==(const CameraModel& a, const CameraModel& b) {
  const Intrinsics& first = a.intrinsics();
  const Intrinsics& second = b.intrinsics();
  for (const auto& [name, number] : kNumbers) {
    if (first.*number != second.*number) return false;
  }
  return first.size == second.size && first.distortion == second.distortion &&
         first.coefficients == second.coefficients;
}

bool areAlike(const CameraModel& a, const CameraModel& b) {
  constexpr double kRoundingError = 1e-6;
  const Intrinsics& first = a.intrinsics();
  const Intrinsics& second = b.intrinsics();
  if (first.size != second.size || first.distortion != second.distortion) return false;
  for (const auto& [name, number] : kNumbers) {
    if (std::abs(first.*number - second.*number) > kRoundingError * first.fx) return false;
  }
  for (std::size_t i = 0; i < kMostCoefficients; ++i) {
    const double difference = lens::at(first.coefficients, i) - lens::at(second.coefficients, i);
    if (std::abs(difference) > kRoundingError) return false;
  }
  return true;
}

std::string describe(const CameraModel& camera) {
  const Intrinsics& values = camera.intrinsics();
  std::string words = text(values.size) + " px, focal length " + tenths(values.fx) + " x " + tenths(values.fy) +
                      " px, " + (camera.isPinhole() ? "no distortion" : toString(values.distortion));
  if (camera.usableShare() < 1.0) {
    words += ", " + text(std::floor(100.0 * camera.usableShare())) + " % of the image can be undistorted";
  }
  return words;
}

std::string differences(const CameraModel& camera, const CameraModel& reference) {
  const Intrinsics& ours = camera.intrinsics();
  const Intrinsics& theirs = reference.intrinsics();
  std::vector<std::string> found;
  const auto compare = [&found](const std::string& what, const std::string& value, const std::string& other) {
    found.push_back(what + " " + value + " instead of " + other);
  };
  if (ours.size != theirs.size) compare("size", text(ours.size), text(theirs.size));
  for (const auto& [name, number] : kNumbers) {
    if (ours.*number != theirs.*number) compare(name, text(ours.*number), text(theirs.*number));
  }
  if (ours.distortion != theirs.distortion) {
    compare("distortion", toString(ours.distortion), toString(theirs.distortion));
  }
  if (ours.coefficients != theirs.coefficients) {
    compare("coefficients", coefficientsOf(ours), coefficientsOf(theirs));
  }
  return joined(found);
}

ParameterValues toValues(const CameraModel& camera) {
  const Intrinsics& intrinsics = camera.intrinsics();
  ParameterValues values;
  values["width"] = static_cast<std::int64_t>(intrinsics.size.width);
  values["height"] = static_cast<std::int64_t>(intrinsics.size.height);
  for (const auto& [name, number] : kNumbers) values[name] = intrinsics.*number;
  values["distortion"] = toString(intrinsics.distortion);
  for (std::size_t i = 0; i < intrinsics.coefficients.size(); ++i) {
    values["d" + std::to_string(i)] = intrinsics.coefficients[i];
  }
  return values;
}

CameraModel cameraOf(const ParameterValues& values) {
  ParameterValues left = values;
  Intrinsics intrinsics;
  intrinsics.size = {takeSide(left, "width"), takeSide(left, "height")};
  for (const auto& [name, number] : kNumbers) intrinsics.*number = take<double>(left, name);
  intrinsics.distortion = distortionOf(take<std::string>(left, "distortion"));
  for (std::size_t i = 0; i < kMostCoefficients && left.count("d" + std::to_string(i)) > 0; ++i) {
    intrinsics.coefficients.push_back(take<double>(left, "d" + std::to_string(i)));
  }
  if (!left.empty()) throw CameraError("unknown value '" + oneLine(left.begin()->first, 60) + "'");
  return CameraModel(intrinsics);
}

}  // namespace visual_localization

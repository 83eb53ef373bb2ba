// Cameras as words and as named values.
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "base/text.h"
#include "visual_localization/camera/camera_model.h"

namespace visual_localization {
namespace {

constexpr std::array<std::pair<Distortion, const char*>, 3> kNames = {
    {{Distortion::kPlumbBob, "plumb_bob"},
     {Distortion::kRationalPolynomial, "rational_polynomial"},
     {Distortion::kEquidistant, "equidistant"}}};

constexpr std::size_t kMostCoefficients = 8;

using Number = std::pair<const char*, double Intrinsics::*>;
constexpr std::array<Number, 4> kNumbers = {
    {{"fx", &Intrinsics::fx}, {"fy", &Intrinsics::fy}, {"cx", &Intrinsics::cx}, {"cy", &Intrinsics::cy}}};

std::string text(double value) {
  std::ostringstream out = numberStream(6);
  out << value;
  return out.str();
}

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

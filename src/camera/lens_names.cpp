#include "camera/lens_names.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>

#include "base/text.h"

namespace visual_localization {
namespace {

enum class Family { kUnnamed, kPinhole, kPerspective, kEquidistant };

struct Name {
  const char* name;
  Family family;
};

/// In lower case, without what separates words. Those of sensor_msgs, OpenCV, kalibr, camodocal and COLMAP.
constexpr std::array<Name, 17> kNames{{{"", Family::kUnnamed},
                                       {"none", Family::kPinhole},
                                       {"nodistortion", Family::kPinhole},
                                       {"undistorted", Family::kPinhole},
                                       {"rectified", Family::kPinhole},
                                       {"pinhole", Family::kUnnamed},  // of camodocal, with coefficients too
                                       {"plumbbob", Family::kPerspective},
                                       {"brownconrady", Family::kPerspective},
                                       {"radtan", Family::kPerspective},
                                       {"radialtangential", Family::kPerspective},
                                       {"rationalpolynomial", Family::kPerspective},
                                       {"equidistant", Family::kEquidistant},
                                       {"equi", Family::kEquidistant},
                                       {"fisheye", Family::kEquidistant},
                                       {"opencvfisheye", Family::kEquidistant},
                                       {"kannalabrandt", Family::kEquidistant},
                                       {"kannalabrandt4", Family::kEquidistant}}};

constexpr std::size_t kPlumbBob = 5;
constexpr std::size_t kRational = 8;
constexpr std::size_t kEquidistant = 4;
constexpr std::size_t kMost = 14;  ///< of any of OpenCV's models

std::string lettersOf(const std::string& name) {
  std::string letters;
  for (const char c : name) {
    if (c == '_' || c == '-' || c == ' ') continue;
    letters += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return letters;
}

Family familyOf(const std::string& name) {
  const std::string letters = lettersOf(name);
  const auto* found =
      std::find_if(kNames.begin(), kNames.end(), [&](const Name& known) { return letters == known.name; });
  if (found != kNames.end()) return found->family;
  throw CameraError("unknown distortion model '" + oneLine(name, 60) +
                    "', allowed: none, plumb_bob, rational_polynomial, equidistant");
}

/// How many there are before nothing but zeros.
std::size_t countedOf(const std::vector<double>& coefficients) {
  const auto last = std::find_if(coefficients.rbegin(), coefficients.rend(), [](double value) { return value != 0.0; });
  return static_cast<std::size_t>(coefficients.rend() - last);
}

/// The counts that are usual stay as they are.
Lens perspective(std::vector<double> coefficients) {
  const std::size_t counted = countedOf(coefficients);
  if (counted > kRational) {
    throw CameraError("distortion coefficient " + std::to_string(counted - 1) +
                      " is not zero: the lens models known have no thin prism and no tilt");
  }
  const std::size_t given = coefficients.size();
  if (counted > kPlumbBob) {
    coefficients.resize(kRational, 0.0);
    return {Distortion::kRationalPolynomial, coefficients};
  }
  if (given > kPlumbBob) coefficients.resize(kPlumbBob);
  return {Distortion::kPlumbBob, coefficients};
}

Lens equidistant(std::vector<double> coefficients) {
  if (coefficients.empty() || countedOf(coefficients) <= kEquidistant) coefficients.resize(kEquidistant, 0.0);
  return {Distortion::kEquidistant, coefficients};
}

/// Four coefficients may be those of plumb_bob or of equidistant.
Lens unnamed(const std::string& name, const std::vector<double>& coefficients) {
  if (countedOf(coefficients) == 0) return {};
  if (coefficients.size() > kEquidistant) return perspective(coefficients);
  throw CameraError("the distortion model '" + oneLine(name, 60) + "' says nothing about its " +
                    std::to_string(coefficients.size()) + " coefficients: name plumb_bob or equidistant");
}

}  // namespace

Lens lensOf(const std::string& name, const std::vector<double>& coefficients) {
  const Family family = familyOf(name);
  if (coefficients.size() > kMost) {
    throw CameraError("the distortion model '" + oneLine(name, 60) + "' takes at most 14 coefficients, not " +
                      std::to_string(coefficients.size()));
  }
  if (family == Family::kUnnamed) return unnamed(name, coefficients);
  if (family == Family::kEquidistant) return equidistant(coefficients);
  if (family == Family::kPinhole) {
    if (countedOf(coefficients) == 0) return {};
    throw CameraError("the distortion model '" + oneLine(name, 60) + "' has coefficients that are not zero");
  }
  // Eight zeros of a model that takes eight are no other model.
  if (name == toString(Distortion::kRationalPolynomial) && coefficients.size() == kRational) {
    return {Distortion::kRationalPolynomial, coefficients};
  }
  return perspective(coefficients);
}

}  // namespace visual_localization

#include "geo/coordinate_units.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/numbers.h"

namespace visual_localization {
namespace {

bool isKnown(const Fix& fix) {
  const GeodeticPoint& point = fix.position;
  const bool zero = point.latitude_deg == 0.0 && point.longitude_deg == 0.0;
  return std::isfinite(point.latitude_deg) && std::isfinite(point.longitude_deg) && !zero;
}

using Holds = std::function<bool(double latitude, double longitude)>;

/// For nearly all positions: a few may be errors.
bool holdsFor(const std::vector<Fix>& fixes, const Holds& holds) {
  constexpr double kNearlyAll = 0.95;
  std::size_t known = 0;
  std::size_t count = 0;
  for (const Fix& fix : fixes) {
    if (!isKnown(fix)) continue;
    ++known;
    if (holds(fix.position.latitude_deg, fix.position.longitude_deg)) ++count;
  }
  return known > 1 && static_cast<double>(count) >= kNearlyAll * static_cast<double>(known);
}

void scale(std::vector<Fix>& fixes, double factor) {
  for (Fix& fix : fixes) {
    fix.position.latitude_deg *= factor;
    fix.position.longitude_deg *= factor;
  }
}

bool isEarth(double latitude, double longitude) { return std::abs(latitude) <= 90.0 && std::abs(longitude) <= 180.0; }

bool isBeyond(double latitude, double longitude) { return !isEarth(latitude, longitude); }

/// Within these bounds degrees are open sea south of Ghana; a simulator's world is nearer to latitude and longitude 0.
bool isRadians(double latitude, double longitude) {
  constexpr double kSimulated = 0.2;
  return std::abs(latitude) <= 0.5 * kPi && std::abs(longitude) <= kPi &&
         std::max(std::abs(latitude), std::abs(longitude)) > kSimulated;
}

}  // namespace

std::vector<std::string> repairUnits(std::vector<Fix>& fixes) {
  std::vector<std::string> said;
  const auto none_has_fix = std::none_of(fixes.begin(), fixes.end(), [](const Fix& fix) { return fix.has_fix; });
  if (none_has_fix && holdsFor(fixes, [](double, double) { return true; })) {
    for (Fix& fix : fixes) fix.has_fix = isKnown(fix);
    said.emplace_back("fixes: all have the status 'no fix' (-1), and positions: the status is not believed");
  }
  if (holdsFor(fixes, isBeyond)) {
    if (holdsFor(fixes, [](double a, double b) { return isEarth(a, b - 360.0) && b > 180.0; })) {
      for (Fix& fix : fixes) fix.position.longitude_deg = std::remainder(fix.position.longitude_deg, 360.0);
      said.emplace_back("fixes: longitudes are from 0 to 360 degrees, taken as -180 to 180");
    } else if (holdsFor(fixes, [](double a, double b) { return isEarth(b, a); })) {
      for (Fix& fix : fixes) std::swap(fix.position.latitude_deg, fix.position.longitude_deg);
      said.emplace_back("fixes: latitude and longitude are exchanged, put right");
    } else if (holdsFor(fixes, [](double a, double b) {
                 return isEarth(1e-7 * a, 1e-7 * b) && std::max(std::abs(a), std::abs(b)) > 1e4;
               })) {
      scale(fixes, 1e-7);
      said.emplace_back("fixes: latitude and longitude are in 1e-7 degrees, taken so");
    }
  } else if (holdsFor(fixes, isRadians)) {
    scale(fixes, 180.0 / kPi);
    said.emplace_back(
        "fixes: latitude and longitude are in radians (as degrees they would be in the open sea), taken so");
  }
  return said;
}

}  // namespace visual_localization

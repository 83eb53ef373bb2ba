#pragma once

#include <string>
#include <vector>

#include "visual_localization/camera/camera_model.h"

namespace visual_localization {

/// Model and coefficients of a lens, as CameraModel takes them.
struct Lens {
  Distortion distortion = Distortion::kPlumbBob;
  std::vector<double> coefficients;
};

/// What a driver means by the name of a model and its coefficients, which differ from driver to driver: "none" or no
/// name for a lens without distortion, "fisheye" or "kannala_brandt" for equidistant, zeros behind the last coefficient
/// that counts, plumb_bob with the eight of rational_polynomial. Throws CameraError when they do not say it.
Lens lensOf(const std::string& name, const std::vector<double>& coefficients);

}  // namespace visual_localization

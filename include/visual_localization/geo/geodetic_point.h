#pragma once

#include <cstdint>

namespace visual_localization {

/// A position on the WGS84 ellipsoid.
struct GeodeticPoint {
  double latitude_deg = 0.0;   ///< north positive, [-90, 90]
  double longitude_deg = 0.0;  ///< east positive, [-180, 180]
  double altitude_m = 0.0;     ///< above the ellipsoid
};

/// One reading of a GPS receiver. Whatever the receiver reported is kept: cleaning decides what to believe.
struct Fix {
  std::int64_t stamp_ns = 0;  ///< nanoseconds since the epoch of the recording
  GeodeticPoint position;     ///< may hold NaN when there is no fix
  bool has_fix = false;       ///< the receiver's own claim
  double sigma_m = 0.0;       ///< horizontal standard deviation per axis by the receiver's own claim; 0: none
  double sigma_up_m = 0.0;    ///< that of the altitude; 0: none
};

}  // namespace visual_localization

#pragma once

#include <cstddef>

namespace visual_localization {

/// What the adjustment of a session came to; all zero when its camera is not calibrated.
struct SessionLandmarks {
  std::size_t located = 0;  ///< images with a pose and landmarks
  std::size_t landmarks = 0;
  std::size_t sightings = 0;             ///< features that show one
  bool contradicts_calibration = false;  ///< then the session has places only
  double focal_scale = 1.0;              ///< what the images say the focal length is, as a share of the calibration's
  double median_error_px = 0.0;          ///< distance of a sighting from its landmark's projection
  double mean_shift_m = 0.0;             ///< of these images from the cleaned path
  double largest_shift_m = 0.0;
  double far_share = 0.0;       ///< of all images: moved by more than 3 m
  double fix_delay_s = 0.0;     ///< fixes say where the antenna was this long before their stamps
  double tied_apart_m = 0.0;    ///< from what the sessions before see as well, before they were tied; 0: not tied
  double agreeing_share = 1.0;  ///< of the features matched over several images: those that the adjustment explains
};

}  // namespace visual_localization

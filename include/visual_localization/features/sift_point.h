#pragma once

namespace visual_localization {

/// A place in scale space that is described once for each of its orientations.
struct SiftPoint {
  int octave = 0;          ///< 0: twice the image's resolution
  int level = 0;           ///< whose gradients describe it: 1 .. octave_layers
  int column = 0;          ///< nearest sample, px of the octave
  int row = 0;             ///< nearest sample, px of the octave
  float x_px = 0.0F;       ///< interpolated, px of the octave
  float y_px = 0.0F;       ///< interpolated, px of the octave
  float sigma_px = 0.0F;   ///< its scale, px of the octave
  float response = 0.0F;   ///< contrast, share of full intensity
  float angle_deg = 0.0F;  ///< [0, 360), clockwise in the image
};

}  // namespace visual_localization

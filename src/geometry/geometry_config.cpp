#include "visual_localization/geometry/geometry_config.h"

namespace visual_localization {

void GeometryConfig::declare(ParameterVisitor& visitor) {
  visitor.flag({"geometry/enabled", "", "triangulate landmarks and adjust poses where the camera is calibrated"},
               enabled);
  visitor.flag({"geometry/self_calibration", "",
                "of a session without calibration find the focal length by its images; takes minutes"},
               self_calibration);
  visitor.integer({"geometry/pair_span", "1", "each image is matched with this number of the next ones"}, pair_span, 1,
                  100);
  visitor.real({"geometry/match_ratio", "1", "largest ratio of the angles to the nearest and second nearest"},
               match_ratio, 0.1, 1.0);
  visitor.real({"geometry/epipolar_tolerance", "px", "farthest of a match from its epipolar line"},
               epipolar_tolerance_px, 0.01, 100.0);
  visitor.integer({"geometry/min_pair_inliers", "1", "two images with fewer verified matches do not count as a pair"},
                  min_pair_inliers, 6, 10000);
  visitor.real({"geometry/keypoint_sigma", "px", "standard deviation of the position of a small SIFT feature"},
               keypoint_sigma_px, 0.01, 100.0);
  visitor.real({"geometry/max_residual", "1", "sightings farther from their landmark, in sigmas, are dropped"},
               max_residual_sigmas, 1.0, 1000.0);
  visitor.real({"geometry/fix_sigma", "m", "standard deviation per axis of a fix that does not tell its own"},
               fix_sigma_m, 0.001, 100.0);
  visitor.real({"geometry/fix_correlation", "1",
                "fixes err alike for many images: this multiple of their sigma is that of one image's position"},
               fix_correlation, 1.0, 100.0);
  visitor.real({"geometry/fix_loss", "1",
                "fixes much farther from the adjusted path than this multiple of that sigma lose their say"},
               fix_loss, 0.01, 1000.0);
  visitor.real({"geometry/fix_bias", "1",
                "what slow errors of the receiver leave in the map, per axis, as a multiple of a fix's sigma"},
               fix_bias, 0.0, 100.0);
  visitor.integer({"geometry/min_landmarks", "1", "an image with fewer landmarks has a place only"}, min_landmarks, 4,
                  10000);
  visitor.real(
      {"geometry/spacing", "m",
       "of a session with landmarks keep, after all images were adjusted, only those at least this far from the "
       "last kept one"},
      spacing_m, 0.0, 1000.0);
}

}  // namespace visual_localization

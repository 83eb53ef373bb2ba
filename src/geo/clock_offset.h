#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace visual_localization {

/// How far the picture moved between two images of a drive: a rotation of the camera moves all of it.
struct PictureShift {
  std::int64_t from_ns = 0;
  std::int64_t to_ns = 0;
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();  ///< right and down, as a share of the image's width
};

/// A believed position of the drive.
struct StampedPosition {
  std::int64_t stamp_ns = 0;
  Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< east, north
};

/// Stamps of fixes against those of images, by the turns that both show.
struct ClockOffset {
  double offset_s = 0.0;        ///< by so much later are fixes stamped than images of the same moment
  double sigma_s = 0.0;         ///< by the fixes' own errors; what a lever arm of the antenna adds is not in it
  double sigmas = 0.0;          ///< how much better the turns explain the path than no turns do
  double at_zero_sigmas = 0.0;  ///< how much better than without the offset
  double width_rad = 0.0;       ///< angle of view by the turns; negative: the picture turns the wrong way
  bool along_rows = true;       ///< a turn moves the picture along its rows; otherwise along its columns
};

/// Farthest offset that is looked for.
constexpr double kClockReach_s = 30.0;

/// The time by which the turns of the path must be moved so that the pictures turn with it: the peak of their
/// correlation, each frequency weighted by how exactly the path knows it (generalised cross-correlation; Knapp and
/// Carter, 1976). Nothing when no turn stands out: a straight drive, or pictures of another one. Both in order of time.
std::optional<ClockOffset> clockOffset(const std::vector<PictureShift>& pictures,
                                       const std::vector<StampedPosition>& path);

}  // namespace visual_localization

#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include <Eigen/Core>

namespace visual_localization {

struct Estimate;
struct StateConfig;

/// Why the state is what it is. The numbers are those of msg/Reason.msg.
enum class StateReason : std::uint8_t {
  kNotSureYet = 0,
  kLandmarks = 1,
  kAlongTheWay = 2,
  kSimilarImages = 3,
  kPlacesAlike = 4,
  kWeakMatches = 5,
  kFewFeatures = 6,
  kMapEnds = 7,
  kNotMapped = 8,
  kOtherDirection = 9,
  kOtherLens = 10,
  kOtherShape = 11,
  kNoLandmarks = 12,
  kUnsteady = 13,
  kImageLate = 14,
  kImagesDropped = 15,
  kImageRepeated = 16,
  kCameraSilent = 17,
  kClocksDiffer = 18,
  kNoMap = 19,
  kVague = 20,
};
inline constexpr std::size_t kReasons = 21;

/// A reason in words.
struct ReasonText {
  const char* name;      ///< of the constant in msg/Reason.msg
  const char* sentence;  ///< what is the case
  const char* figure;    ///< what Why::figure is; empty: there is none
  const char* advice;    ///< what to do; "-": nothing
};

const ReasonText& textOf(StateReason reason);

/// A reason with what belongs to it; NaN where there is none.
struct Why {
  StateReason reason = StateReason::kNotSureYet;
  double figure = std::numeric_limits<double>::quiet_NaN();
  Eigen::Vector2d position_m = Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());  ///< in `map`
};

/// "The robot is beyond an end of the map, at x = 12.30 m, y = -4 m (probability off the map: 0.91)".
std::string describe(const Why& why);

/// What a filter over the places of a map says after an image. All probabilities are of everything that is possible,
/// [0, 1]; NaN: unknown.
struct PlaceBelief {
  struct Place {
    std::size_t training_image = 0;
    Eigen::Vector2d position_m = Eigen::Vector2d::Zero();  ///< of that image, in the frame `map`
    double probability = 0.0;
  };
  double off_map = std::numeric_limits<double>::quiet_NaN();   ///< where the map has no image
  double followed = std::numeric_limits<double>::quiet_NaN();  ///< around the estimate, if the robot is in the map
  std::optional<Place> rival;                                  ///< the most probable place elsewhere in the map
  std::optional<Place> end;                                    ///< of a path, beyond which the robot most probably is
};

/// What the localizer knows beside the estimate.
struct Circumstances {
  bool late = false;      ///< the image is older than the one before
  bool turned = false;    ///< the robot looks where no training image nearby does
  bool doubtful = false;  ///< thresholds alone: the images look more like another place
  std::size_t unconfirmed = 0;
  std::optional<PlaceBelief::Place> left_at;  ///< the end of the map that the robot passed since it was confirmed
};

/// The first cause that holds, for an estimate whose state is decided.
Why explain(const Estimate& estimate, const StateConfig& config, const Circumstances& circumstances);

}  // namespace visual_localization

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/geo/trajectory.h"
#include "visual_localization/map/training_map.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// What counts as weak.
struct WatchConfig {
  double max_spacing_m = 2.0;
  double max_fix_sigma_m = 3.0;

  void declare(ParameterVisitor& visitor);
};

/// What a map will lack where an image was recorded; the first that holds.
enum class Weakness : std::uint8_t {
  kNone,
  kNoFix,
  kPoorFix,      ///< the receiver itself doubts its fixes
  kFewFeatures,  ///< too dark, too bright, blurred, or nothing to see
  kFarApart,     ///< too fast for the rate of the camera
};
constexpr std::size_t kWeaknesses = 5;
const char* describe(Weakness weakness);

/// Looks at a session while it is recorded and says what will be weak in its map, as long as the robot is still there.
class RecordingWatch {
 public:
  /// An image that was looked at, where the last usable fix was.
  struct Spot {
    Eigen::Vector2d position_m =
        Eigen::Vector2d::Zero();  ///< east, north in the map's frame, or about the first usable fix
    Weakness weakness = Weakness::kNone;
  };
  /// What is known so far.
  struct Summary {
    std::size_t images = 0;                          ///< that were looked at
    std::array<std::size_t, kWeaknesses> weak = {};  ///< images by weakness
    Weakness now = Weakness::kNone;                  ///< of the last image
    std::size_t fixes = 0;
    std::size_t usable_fixes = 0;
    double fix_sigma_m = 0.0;      ///< of the last usable one; 0: the receiver does not say
    double way_m = 0.0;            ///< driven, in steps of 3 m
    double spacing_m = 0.0;        ///< of the last images
    std::size_t features = 0;      ///< of the last image
    double known_way_share = 0.0;  ///< of the images: within 2 m of a session of the map that was recorded within 2 h
                                   ///< of this time of day, so that they add little
  };

  /// `map`: the one that the session will be added to; null: none.
  RecordingWatch(const WatchConfig& config, std::shared_ptr<const TrainingMap> map);

  void addFix(const Fix& fix);
  void addImage(std::int64_t stamp_ns);
  /// A slow computer does not look at all images.
  void addLook(std::int64_t stamp_ns, std::size_t features);

  Summary summary() const { return summary_; }
  /// Since the first usable fix, in their order.
  const std::vector<Spot>& spots() const { return spots_; }

 private:
  bool hasPositionAt(std::int64_t stamp_ns) const;
  Weakness weaknessOf(std::int64_t stamp_ns, std::size_t features) const;
  bool isKnown(std::int64_t stamp_ns) const;
  void addWay();

  WatchConfig config_;
  std::shared_ptr<const TrainingMap> map_;
  std::optional<LocalFrame> frame_;  ///< of the spots
  std::optional<Fix> last_fix_;      ///< usable
  Eigen::Vector2d position_m_ = Eigen::Vector2d::Zero();
  std::deque<Eigen::Vector2d> last_images_;
  std::optional<Eigen::Vector2d> way_from_m_;
  std::size_t placed_ = 0;  ///< images that were looked at and have a position
  std::size_t known_ = 0;   ///< of these
  std::vector<Spot> spots_;
  Summary summary_;
};

}  // namespace visual_localization

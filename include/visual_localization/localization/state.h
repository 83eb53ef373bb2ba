#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/localization/similarity.h"
#include "visual_localization/localization/tracker.h"
#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// How far an estimate may be trusted.
enum class LocalizationState : std::uint8_t {
  kNoMap = 0,
  kInitializing = 1,  ///< the position was unknown and has not been confirmed yet
  kTracking = 2,      ///< recognised images confirm the position
  kUncertain = 3,     ///< the last images do not confirm it
  kRecovering = 4,    ///< taken to be lost; the tracker searches
  kOffMap = 5,        ///< nothing in the map has been recognised for long: probably far from all of it
};

/// "NO_MAP", "INITIALIZING", ...
std::string toString(LocalizationState state);

/// When a position counts as confirmed. What has a comment is no parameter.
struct StateConfig {
  std::string witness = "probability";
  double min_probability = 0.97;
  double min_similarity = 0.08;  ///< of a best match by local features
  int min_matches = 5;           ///< of few features a large share matches by chance
  double max_scale = 1.2;
  double min_global_similarity = 0.65;  ///< of a best match by global features
  double max_distance_m = 5.0;          ///< between a best match that confirms the estimate and it
  double max_sigma_m = 5.0;   ///< of a claimed position, where training images are not farther apart than that
  int window = 5;             ///< how many of the last images decide
  int images_to_confirm = 4;  ///< how many of them must confirm
  double max_step_m = 10.0;   ///< a larger jump of the estimate voids earlier confirmations
  bool place_check = true;
  double sure_similarity = 0.2;    ///< a stronger match of local features needs no place check
  double min_place_ratio = 0.985;  ///< mean over the window; below, the images look more like another place
  double max_motion_residual_m = 2.5;
  int off_map_images = 10;  ///< that confirm nothing
  int min_features = 10;    ///< an image with fewer is blind and says nothing about OFF_MAP
  int frozen_images = 3;
  double frozen_time_s = 1.0;  ///< a stream may repeat each image to reach its rate

  void declare(ParameterVisitor& visitor);
};

/// What one image says about the position that the tracker estimates.
struct Evidence {
  FeatureKind features = FeatureKind::kLocal;  ///< by which particles were compared
  double place_ratio = 1.0;                    ///< see MapSweep::ratio; 1 when there was no need to ask
  bool blind = false;                          ///< there is hardly anything to see in the image
  /// Whether landmarks verify the pose; nothing where map or camera do not allow that. Then it alone decides.
  std::optional<bool> verified = {};
  /// How likely the robot is around the estimate, by a filter over the training images; nothing where the similarity
  /// of the image decides.
  std::optional<double> probability = {};
  /// The position is known too badly to claim it, however probable it is.
  bool vague = false;
  bool unverified = false;  ///< it would confirm the estimate, were there not landmarks that do not
};

/// Whether the last estimates follow one motion. A robot moves steadily between a few images; an estimate that jumps
/// to and fro does not follow one.
class MotionConsistency {
 public:
  explicit MotionConsistency(std::size_t length) : length_(length) {}

  void clear() { points_.clear(); }
  /// `position_m` at an image with this stamp.
  void add(std::int64_t stamp_ns, const Eigen::Vector2d& position_m);
  /// Root mean square distance of the positions from the uniform motion along a straight line that fits them best; 0
  /// with fewer than three of them. By the images' order when their stamps do not rise.
  double residual_m() const;

 private:
  struct Point {
    std::int64_t stamp_ns = 0;
    Eigen::Vector2d position_m = Eigen::Vector2d::Zero();
  };

  bool stampsRise() const;

  std::size_t length_;
  std::vector<Point> points_;
};

/// Turns the evidence of successive images into a state. The cloud alone cannot tell whether a robot is lost;
/// the image match is independent evidence.
class StateAssessor {
 public:
  /// Estimates that must follow a straight line; over more of them a robot may turn.
  static constexpr std::size_t kMotionLength = 10;

  explicit StateAssessor(const StateConfig& config) : config_(config) {}
  /// Other thresholds, with what the last images said: they are not judged anew.
  void configure(const StateConfig& config) { config_ = config; }
  /// The position is unknown again.
  void reset();
  /// What the last images confirmed no longer counts; the state until the next one.
  LocalizationState doubt(bool recovering);
  LocalizationState update(std::int64_t stamp_ns, const TrackerEstimate& estimate, const Evidence& evidence);
  bool lastConfirms() const { return !confirmations_.empty() && confirmations_.back() != 0; }
  /// Whether the last images look more like another position.
  bool isDoubtful() const;
  double motionResidual_m() const { return motion_.residual_m(); }
  /// Images since the last certain position, without those that are blind or see the map; at most
  /// StateConfig::off_map_images.
  int unconfirmed() const { return unconfirmed_; }

 private:
  bool confirms(const TrackerEstimate& estimate, const Evidence& evidence) const;
  void remember(std::int64_t stamp_ns, const TrackerEstimate& estimate, const Evidence& evidence);
  void forget();
  bool isCertain() const;
  LocalizationState stateOf(bool certain, bool recovering) const;

  StateConfig config_;
  std::vector<char> confirmations_;  ///< of the last images, newest at the back
  std::vector<double> place_ratios_;
  MotionConsistency motion_{kMotionLength};
  int unconfirmed_ = 0;
  bool ever_confirmed_ = false;  ///< since the last reset
  std::optional<Eigen::Vector2d> last_position_m_;
};

}  // namespace visual_localization

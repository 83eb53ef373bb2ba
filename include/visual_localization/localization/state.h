#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "visual_localization/localization/estimate.h"
#include "visual_localization/parameters/parameter_visitor.h"

namespace visual_localization {

/// The last estimated positions. A robot moves steadily between a few images; an estimate that jumps to and fro does
/// not follow one.
class Course {
 public:
  explicit Course(std::size_t length) : length_(length) {}

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

/// When a position counts as confirmed.
struct StateConfig {
  double min_similarity = 0.08;         ///< a weaker best SIFT match does not confirm a position
  int min_matches = 5;                  ///< fewer matched SIFT features are no evidence, whatever their share
  double max_scale = 1.2;               ///< a best match seen this much larger or smaller does not confirm a position
  double min_global_similarity = 0.65;  ///< a weaker best match by global features does not confirm a position
  double max_distance_m = 5.0;          ///< a best match farther from the estimate does not confirm it
  int window = 5;                       ///< so many of the last images are looked at
  int images_to_confirm = 4;            ///< so many of them must confirm the position
  double max_step_m = 10.0;             ///< a larger jump between two images makes what came before worthless
  bool place_check = true;              ///< ask the whole image whether another place looks more alike
  double sure_similarity = 0.2;         ///< a stronger SIFT match needs no such second witness
  double min_place_ratio = 0.985;       ///< mean over the window; below, the position is in doubt
  int place_check_images = 1000;        ///< of a larger map only so many images are asked per image
  int course_length = 10;               ///< so many of the last estimates must follow a steady motion
  double max_course_residual_m = 2.5;   ///< up to this root mean square distance from it
  int off_map_images = 10;              ///< so many images that confirm nothing: off the map
  int min_features = 10;                ///< images with fewer SIFT features are blind: they say nothing either way
  int frozen_images = 3;                ///< so many images in a row without any change: the camera is frozen; 0: never
  double frozen_time_s = 1.0;           ///< but only once they span so much time

  void declare(ParameterVisitor& visitor);
  std::vector<std::string> violations() const;
};

/// What one image says about the position.
struct Evidence {
  std::int64_t stamp_ns = 0;
  FeatureKind features = FeatureKind::kSift;
  bool recovering = false;   ///< the tracker takes itself to be lost
  double place_ratio = 1.0;  ///< see PlaceCheck
  bool blind = false;        ///< there is hardly anything to see in the image
};

/// Turns the evidence of successive images into a state. The cloud alone cannot tell whether a robot is lost;
/// the image match is independent evidence.
class StateAssessor {
 public:
  explicit StateAssessor(const StateConfig& config)
      : config_(config), course_(static_cast<std::size_t>(config.course_length)) {}
  /// Other thresholds, with what the last images said: they are not judged anew.
  void configure(const StateConfig& config);
  /// The position is unknown again.
  void reset();
  /// What the last images confirmed no longer counts; the state until the next one.
  LocalizationState doubt(bool recovering);
  /// The state after one more image.
  LocalizationState assess(const TrackerEstimate& estimate, const Evidence& evidence);
  /// Whether the last image confirms the position.
  bool lastConfirms() const { return !confirmations_.empty() && confirmations_.back() != 0; }
  /// Whether the last images look more like another place.
  bool isDoubtful() const;
  double courseResidual_m() const { return course_.residual_m(); }

 private:
  bool confirms(const TrackerEstimate& estimate, FeatureKind features) const;
  void remember(const TrackerEstimate& estimate, const Evidence& evidence);
  void forget();
  bool isCertain() const;
  LocalizationState stateOf(bool certain, bool recovering) const;

  StateConfig config_;
  std::vector<char> confirmations_;  ///< of the last images, newest at the back
  std::vector<double> place_ratios_;
  Course course_;
  int unconfirmed_ = 0;  ///< images since the last certain position, without those that are blind or see the map
  bool ever_confirmed_ = false;  ///< since the last reset
  std::optional<Eigen::Vector2d> last_position_m_;
};

}  // namespace visual_localization

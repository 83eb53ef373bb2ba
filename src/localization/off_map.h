#pragma once

#include <cstddef>
#include <vector>

namespace visual_localization {

/// Mean and variance of what came lately.
struct RunningGaussian {
  double mean = 0.0;
  double variance = 1.0;
  double weight = 0.0;  ///< of what is known so far
  /// `most`: so much weight what came before has at most.
  void add(double value, double value_weight, double most);
};

/// How likely the robot is where the map has no image: beyond an end of its path, or beside it. A second state of
/// PlaceFilter, in which all training images match as by chance, and which the robot enters where its motion leads
/// beyond all its places. What matches by chance, and what the right place matches in this light, is learnt from
/// the live images. Matches count as the logarithm of their number and one.
class OffMapBelief {
 public:
  /// A training image that the live image was compared with.
  struct Compared {
    double predicted = 0.0;  ///< probability of being there before the image
    double log_matches = 0.0;
    double beyond = 0.0;  ///< the same of being beyond it, where it is an end of the path
  };

  void reset(double probability = kUnknown);
  /// Something else is sure whether the robot is in the map.
  void settle(bool in_map) { probability_ = in_map ? kHardly : 1.0 - kHardly; }
  /// Before anything is known of it.
  static constexpr double kUnknown = 0.5;
  /// Where something else is sure that it is in the map.
  static constexpr double kHardly = 0.002;

  /// `leaving`: how likely the motion led beyond the training images, from where the robot was in the map.
  void predict(double leaving);
  /// What an image says. It counts in full even where the robot hardly moved: had it left, the image would be another.
  void update(const std::vector<Compared>& compared);
  /// Of a training image that shows another place.
  void learnChance(double log_matches);
  /// Of the best match near the most probable place; `certainty` that the robot is there, given that it is in the map.
  void learnUsual(double log_matches, double certainty);

  /// How much likelier such a match is somewhere beyond a training image at the end of a path than at it.
  double beyondRatio(double log_matches) const;

  double probability() const { return probability_; }
  bool knowsChance() const { return chance_.weight > 0.0; }

 private:
  double byChance(double log_matches) const;
  double alike(double log_matches) const;
  double right(double log_matches) const;
  double likelihoodRatio(double log_matches) const;

  double probability_ = kUnknown;
  RunningGaussian chance_;
  RunningGaussian usual_;
};

}  // namespace visual_localization

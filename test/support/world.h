#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "localization/image_likelihood.h"
#include "localization/session_choice.h"
#include "test/support/synthetic.h"
#include "visual_localization/localization/scores.h"
#include "visual_localization/localization/tracker.h"

namespace visual_localization::test {

/// An image as a tracker gets it: what it shows, and what is known of it beside that.
struct Seen {
  const TrainingMap& map;
  Scores& scores;
  Likelihood& likelihood;
  Motion motion = {};                              ///< up to it
  std::optional<Eigen::Vector2d> verified_m = {};  ///< instead of what it shows
};

inline TrackerEstimate see(Tracker& tracker, const Seen& seen) {
  tracker.predict(seen.motion);
  if (seen.verified_m) {
    PoseLikelihood verified(seen.map, *seen.verified_m);
    tracker.update(verified);
  } else {
    tracker.update(seen.likelihood);
  }
  return tracker.belief();
}

/// The image that the tracker saw last was taken here.
template <class Place>
void verify(Tracker& tracker, const Place& place, const Eigen::Vector2d& position_m) {
  PoseLikelihood verified(place.map(), position_m);
  tracker.update(verified);
}

/// A world without images: how alike two places look depends on their distance only.
class World {
 public:
  explicit World(std::shared_ptr<const TrainingMap> map)
      : map_(std::move(map)), scores_(map_->size()), sweep_(*map_, 100000, 100000), sessions_(*map_, false) {}

  /// What the robot sees from here; globally, places within some 10 m look alike.
  Seen from(const Eigen::Vector2d& robot_m) {
    scores_.startImage(FeatureKind::kLocal, [this, robot_m](FeatureKind kind, std::size_t image) {
      return kind == FeatureKind::kLocal ? scoreAt(0.5 * bell(image, robot_m, 2.0))
                                         : scoreAt(bell(image, robot_m, 10.0));
    });
    sweep_.startImage();
    return {*map_, scores_, likelihood_};
  }

  Seen inTheDark() {
    scores_.startImage(FeatureKind::kLocal, [](FeatureKind, std::size_t) { return Score{}; });
    sweep_.startImage();
    return {*map_, scores_, likelihood_};
  }

  static Score scoreAt(double similarity) {
    return {similarity, similarity, static_cast<std::size_t>(100.0 * similarity), similarity >= 0.05};
  }

  const TrainingMap& map() const { return *map_; }

 private:
  double bell(std::size_t image, const Eigen::Vector2d& robot_m, double width_m) const {
    const double distance = (map_->position_m(image) - robot_m).norm() / width_m;
    return std::exp(-0.5 * distance * distance);
  }

  std::shared_ptr<const TrainingMap> map_;
  Scores scores_;
  MapSweep sweep_;
  SessionChoice sessions_;
  ImageLikelihood likelihood_{scores_, sweep_, sessions_, LocalizerConfig()};
};

/// Radius 30 m, an image every 0.94 m.
inline World roundWorld() { return World(mapAt(circle(200, 30.0))); }

inline Eigen::Vector2d onCircle(double arc_m) {
  return 30.0 * Eigen::Vector2d(std::cos(arc_m / 30.0), std::sin(arc_m / 30.0));
}

inline std::size_t countOf(const std::vector<Particle>& particles, ParticleKind kind) {
  return static_cast<std::size_t>(
      std::count_if(particles.begin(), particles.end(), [kind](const Particle& p) { return p.kind == kind; }));
}

inline double sumOfWeights(const std::vector<Particle>& particles) {
  return std::accumulate(particles.begin(), particles.end(), 0.0,
                         [](double sum, const Particle& particle) { return sum + particle.weight; });
}

}  // namespace visual_localization::test
